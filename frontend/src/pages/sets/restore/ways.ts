import { useMutation } from "@tanstack/react-query";
import { queryClient } from "../../../api/queries";
import { type RestoreHead, restoreQuery, restoresQuery, takeWay, type Way } from "../../../api/restore";
import { useTexts } from "../../../texts/texts";
import { notify } from "../../../ui/notices";
import { storyOf } from "../../../ui/problem";

/** What a person orders of a restore that is there: confirm, roll back, resume. */
export function useWay({ id }: Pick<RestoreHead, "id">) {
  const t = useTexts();
  return useMutation({
    mutationFn: (way: Way) => takeWay(id, way),
    onSuccess: (doc) => {
      queryClient.setQueryData(restoreQuery(id).queryKey, doc);
      void queryClient.invalidateQueries({ queryKey: restoresQuery.queryKey });
    },
    onError: (error, way) => {
      const story = storyOf(error, t);
      const title = t(`page.restoring.way_failed.${way}`);
      notify({ tone: "error", title, lines: [story.happened, story.next] });
      void queryClient.invalidateQueries({ queryKey: restoreQuery(id).queryKey });
    },
  });
}
