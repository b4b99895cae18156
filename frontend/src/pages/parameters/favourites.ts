/** The parameters that a person has starred, for each kind of device; kept by the bench under the person's name. */
import { useMutation, useQuery } from "@tanstack/react-query";
import { useCallback, useMemo } from "react";
import { get, send } from "../../api/client";
import { queryClient } from "../../api/queries";
import type { Favourites } from "../../api/types";
import { useTexts } from "../../texts/texts";
import { notify } from "../../ui/notices";
import { storyOf } from "../../ui/problem";

const pathOf = (descriptionId: string) => `/api/favourites/${descriptionId}`;

export function useFavourites(descriptionId: string): {
  starred: ReadonlySet<string>;
  toggleStar: (address: string) => void;
} {
  const t = useTexts();
  const queryKey = useMemo(() => ["favourites", descriptionId], [descriptionId]);
  const kept = useQuery({
    queryKey,
    queryFn: ({ signal }) => get<Favourites>(pathOf(descriptionId), signal),
  }).data;
  const { mutate } = useMutation({
    mutationFn: (addresses: string[]) => send<Favourites>("PUT", pathOf(descriptionId), { addresses }),
    onError: (error) => {
      const story = storyOf(error, t);
      notify({ tone: "error", title: t("page.favourites.failed"), lines: [story.happened] });
      void queryClient.invalidateQueries({ queryKey });
    },
  });
  const starred = useMemo(() => new Set(kept?.addresses), [kept]);
  const toggleStar = useCallback(
    (address: string) => {
      const now = queryClient.getQueryData<Favourites>(queryKey)?.addresses ?? [];
      const addresses = now.includes(address) ? now.filter((one) => one !== address) : [...now, address];
      queryClient.setQueryData<Favourites>(queryKey, { addresses });
      mutate(addresses);
    },
    [queryKey, mutate],
  );
  return { starred, toggleStar };
}
