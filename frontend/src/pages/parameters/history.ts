/** Who changed a parameter last, when and from what: kept by the bench, by device and address. */
import { queryOptions, useQueries } from "@tanstack/react-query";
import { useEffect } from "react";
import { get } from "../../api/client";
import { queryClient } from "../../api/queries";
import { store } from "../../live/live";
import type { DeviceContext } from "../../model/shown";

/** One change; `was` and `now` are texts as they were shown then. */
export interface ParameterChange {
  address: string;
  t_ns: number;
  person: string;
  was: string;
  now: string;
}

type Changes = ReadonlyMap<string, readonly ParameterChange[]>;

const keyOf = (slug: string) => ["changes", slug];

const changesQuery = (slug: string) =>
  queryOptions({
    queryKey: keyOf(slug),
    queryFn: async ({ signal }): Promise<Changes> => {
      const { changes } = await get<{ changes: ParameterChange[] }>(
        `/api/live/devices/${slug}/changes`,
        signal,
      );
      return byAddress(changes);
    },
  });

/** The newest first for each address. */
export function byAddress(changes: readonly ParameterChange[]): Changes {
  const found = new Map<string, ParameterChange[]>();
  for (const change of [...changes].sort((a, b) => b.t_ns - a.t_ns)) {
    const list = found.get(change.address);
    if (list) list.push(change);
    else found.set(change.address, [change]);
  }
  return found;
}

export const changesOf = (slug: string, address: string): readonly ParameterChange[] =>
  queryClient.getQueryData<Changes>(keyOf(slug))?.get(address) ?? [];

export interface LastChange {
  slug: string;
  change: ParameterChange;
}

/** The latest change among the devices shown, or null where none is known. */
export function lastChangeOf(address: string, devices: readonly DeviceContext[]): LastChange | null {
  let last: LastChange | null = null;
  for (const { slug } of devices) {
    const [change] = changesOf(slug, address);
    if (change && (last === null || change.t_ns > last.change.t_ns)) last = { slug, change };
  }
  return last;
}

const WRITTEN = "journal.written";

/** Loads the changes of the devices, and again after every write; gives a number that grows with what is known. */
export function useChanges(slugs: readonly string[]): number {
  const versions = useQueries({
    queries: slugs.map((slug) => changesQuery(slug)),
    combine: (results) => results.reduce((sum, one) => sum + one.dataUpdatedAt, 0),
  });
  useEffect(() => {
    let seen = store.events[0]?.id ?? 0;
    return store.subscribe("events", () => {
      const fresh = store.events.filter((one) => one.id > seen);
      seen = Math.max(seen, ...fresh.map((one) => one.id));
      for (const one of fresh)
        if (one.text_key === WRITTEN && one.device !== null)
          void queryClient.invalidateQueries({ queryKey: keyOf(one.device) });
    });
  }, []);
  return versions;
}
