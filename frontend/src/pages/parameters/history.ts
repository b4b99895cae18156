/** Who changed a parameter last, when and from what: kept by the bench, by device and address. */
import { queryOptions, useQueries } from "@tanstack/react-query";
import { useEffect } from "react";
import { get } from "../../api/client";
import { queryClient } from "../../api/queries";
import type { Details, ParameterChange, ParameterChanges } from "../../api/types";
import { useShown } from "../../live/live";
import type { Translate } from "../../texts/texts";
import { dateAndTime } from "../../ui/format";
import type { Bench } from "./context";

const keyOf = (slug: string) => ["changes", slug];
const pathOf = (slug: string) => `/api/live/devices/${slug}/changes`;

/** The last change of every parameter of a device. */
const lastQuery = (slug: string) =>
  queryOptions({
    queryKey: [...keyOf(slug), "last"],
    queryFn: async ({ signal }) => (await get<ParameterChanges>(pathOf(slug), signal)).last,
  });

/** All changes of one parameter, the newest first. */
export const historyQuery = (slug: string, address: string) =>
  queryOptions({
    queryKey: [...keyOf(slug), "of", address],
    queryFn: async ({ signal }) =>
      (await get<ParameterChanges>(`${pathOf(slug)}?address=${encodeURIComponent(address)}`, signal)).history,
  });

export interface LastChange {
  slug: string;
  change: ParameterChange;
}

/** The latest change among the devices shown, or null where none is known: of a recording the bench keeps none. */
export function lastChangeOf(address: string, { devices, recorded }: Bench): LastChange | null {
  let last: LastChange | null = null;
  if (recorded) return last;
  for (const { slug } of devices) {
    const change = queryClient.getQueryData(lastQuery(slug).queryKey)?.[address];
    if (change && (last === null || change.t_ns > last.change.t_ns)) last = { slug, change };
  }
  return last;
}

/** What fills the texts about a change. Another master has no name. */
export function detailsOf(change: ParameterChange, t: Translate): Details & { when: string; person: string } {
  const { t_ns, was, now, source } = change;
  const person = source === "ours" ? change.person : t("page.history.other_master");
  return { when: dateAndTime(t_ns / 1e6), person, was, now };
}

const WRITTEN = "journal.written";
/** The bench keeps a change a moment after it tells the event. */
const KEPT_MS = 500;

/** Loads the last changes of the devices, and again after every write; grows with what is known. */
export function useChanges(slugs: readonly string[]): number {
  const { store, recorded } = useShown();
  const version = useQueries({
    queries: recorded ? [] : slugs.map((slug) => lastQuery(slug)),
    combine: (results) => results.reduce((sum, one) => sum + one.dataUpdatedAt, 0),
  });
  useEffect(() => {
    if (recorded) return;
    let seen = store.events[0]?.id ?? 0;
    return store.subscribe("events", () => {
      const fresh = store.events.filter((one) => one.id > seen);
      seen = Math.max(seen, ...fresh.map((one) => one.id));
      const devices = new Set(fresh.filter((one) => one.text_key === WRITTEN).map((one) => one.device));
      if (devices.size === 0) return;
      setTimeout(() => {
        for (const slug of devices)
          if (slug !== null) void queryClient.invalidateQueries({ queryKey: keyOf(slug) });
      }, KEPT_MS);
    });
  }, [store, recorded]);
  return version;
}
