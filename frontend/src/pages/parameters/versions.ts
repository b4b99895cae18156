/** Hooks over several devices at a time. */
import { useCallback, useMemo, useRef, useSyncExternalStore } from "react";
import { useHearing, useLink, useNodes, useStore } from "../../live/live";
import type { DeviceContext } from "../../model/shown";

const COARSE_MS = 1000;

/** Grows with the values of these devices, at most once a second: for what looks at all rows. */
export function useCoarseVersion(slugs: readonly string[]): number {
  const store = useStore();
  const shown = useRef(0);
  const read = () => slugs.reduce((sum, slug) => sum + store.version(slug), 0);
  const subscribe = useCallback(
    (listener: () => void) => {
      let timer: ReturnType<typeof setTimeout> | null = null;
      const soon = () => {
        timer ??= setTimeout(() => {
          timer = null;
          shown.current = slugs.reduce((sum, slug) => sum + store.version(slug), 0);
          listener();
        }, COARSE_MS);
      };
      const ends = slugs.map((slug) => store.subscribe(`device:${slug}`, soon));
      return () => {
        if (timer !== null) clearTimeout(timer);
        for (const end of ends) end();
      };
    },
    [store, slugs],
  );
  return useSyncExternalStore(subscribe, () => shown.current || (shown.current = read()));
}

/** The devices of which nothing can be heard: the page is deaf, the bus is gone, or a heartbeat is overdue. */
export function useSilentSlugs(devices: readonly DeviceContext[]): ReadonlySet<string> {
  const hearing = useHearing().state === "hearing";
  const connected = useLink()?.state === "connected";
  const nodes = useNodes();
  const silent = devices
    .filter(({ slug }) => !hearing || !connected || nodes.get(slug)?.silent === true)
    .map((one) => one.slug)
    .join();
  // The same devices give the same set, so that the table is not drawn anew with every heartbeat.
  return useMemo(() => new Set(silent.split(",").filter(Boolean)), [silent]);
}
