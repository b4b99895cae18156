/** Keeps the trace of the room running by the filter in the URL, and fetches what lies outside of it. */
import { useMutation } from "@tanstack/react-query";
import { useCallback, useEffect, useMemo, useRef } from "react";
import { digitsOf, fetchFrames, type Side, type TraceFilter, type TraceLine } from "../../api/trace";
import { usePageSearch } from "../../frame/search";
import { useBench, useFrames, useShown, watchTrace } from "../../live/live";
import { notify } from "../../ui/notices";
import { storyOf } from "../../ui/problem";
import { useTexts } from "../../texts/texts";
import { filterOf } from "./filter";

const PAGE_ROWS = 300;
/** More than the clocks of page and server differ by. */
const AHEAD_MS = 1000;
const WHERE = { before: "before", after: "after", around: "instead" } as const;

interface Ask {
  side: Side;
  tNs: number;
}

export function useTrace() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const channel = useShown();
  const { ctx, frames, store } = channel;
  const view = useFrames();
  const epoch = useBench()?.epoch;
  const { nodes, services, dir, ids, data, q, errors } = search;
  const key = JSON.stringify(filterOf({ nodes, services, dir, ids, data, q, errors } as typeof search));
  const filter = useMemo(() => JSON.parse(key) as TraceFilter, [key]);
  const wanted = Number(search.frame ?? NaN);
  const paused = search.paused !== undefined || Number.isFinite(wanted);

  const { mutate, isPending } = useMutation({
    mutationFn: ({ side, tNs }: Ask) => fetchFrames(ctx, side, tNs, filter, PAGE_ROWS),
    onSuccess: (page, { side, tNs }) => {
      frames.merge(page, WHERE[side]);
      if (side !== "around") return;
      // An event of the journal is no frame: the nearest one is shown.
      const near = nearest(page.rows, tNs);
      if (near === undefined) notify({ tone: "warning", title: t("trace.page.not_found"), lines: [] });
      else if (near.t_ns !== tNs) update({ frame: digitsOf(near.t_ns) });
    },
    onError: (error) => {
      const story = storyOf(error, t);
      notify({ tone: "error", title: t("trace.page.failed"), lines: [story.happened, story.next] });
    },
  });

  const asked = useRef<number | null>(null);
  useEffect(() => {
    const at = new URLSearchParams(location.search);
    // A replay that stands begins at the same moment again: with another filter its rows are others.
    asked.current = null;
    return watchTrace(channel, filter, frames.begin(at.has("paused") || at.has("frame")));
  }, [channel, frames, filter, epoch]);

  // What came before the running trace began, once, exactly up to its first frame; or the moment that is asked for.
  const { startNs } = view;
  useEffect(() => {
    if (startNs === null || asked.current === startNs) return;
    asked.current = startNs;
    const at = Number(new URLSearchParams(location.search).get("frame") ?? NaN);
    if (Number.isFinite(at)) mutate({ side: "around", tNs: at });
    else mutate({ side: "before", tNs: startNs });
  }, [startNs, mutate]);

  // A frame that is not among the rows is fetched with what stands around it.
  useEffect(() => {
    if (!Number.isFinite(wanted) || startNs === null) return;
    if (!frames.view.rows.some((row) => row.t_ns === wanted)) mutate({ side: "around", tNs: wanted });
  }, [frames, wanted, startNs, mutate]);

  const pause = useCallback(() => {
    frames.pause();
    update({ paused: "1" });
  }, [frames, update]);
  const resume = useCallback(() => {
    update({ paused: undefined, frame: undefined });
    frames.resume();
    mutate({ side: "before", tNs: Math.ceil((store.serverNowMs() + AHEAD_MS) * 1e6) });
  }, [frames, store, mutate, update]);

  const edge = (side: Side, tNs: number | undefined) => {
    if (tNs !== undefined && !isPending) mutate({ side, tNs });
  };
  return {
    view,
    paused,
    pause,
    resume,
    fetching: isPending,
    older: () => edge("before", view.reachedNs ?? view.rows[0]?.t_ns ?? startNs ?? undefined),
    newer: () => edge("after", view.rows.at(-1)?.t_ns),
    wanted: Number.isFinite(wanted) ? wanted : null,
  };
}

function nearest(rows: readonly TraceLine[], tNs: number): TraceLine | undefined {
  let best: TraceLine | undefined;
  for (const row of rows)
    if (best === undefined || Math.abs(row.t_ns - tNs) < Math.abs(best.t_ns - tNs)) best = row;
  return best;
}
