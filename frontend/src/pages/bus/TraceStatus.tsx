import { IconPlayerPause, IconPlayerPlay } from "@tabler/icons-react";
import { usePageSearch } from "../../frame/search";
import { useLink, useShown } from "../../live/live";
import { figure } from "../../model/values";
import { type Translate, useTexts } from "../../texts/texts";
import { timeOfDay } from "../../ui/format";
import classes from "./Bus.module.css";
import { isFiltered } from "./filter";
import type { useTrace } from "./useTrace";

/** Says what share of the traffic is on the screen, where it comes from, and how much came since the pause. */
export function TraceStatus({ trace }: { trace: ReturnType<typeof useTrace> }) {
  const t = useTexts();
  const { recorded } = useShown();
  const recording = useLink()?.recording.state === "on";
  const [search] = usePageSearch();
  const { view, paused } = trace;
  const number = (per: number) => figure(per, 0, t.language);
  const { rates } = view;
  const share = rates.sampled
    ? t(recording ? "trace.page.sample" : "trace.page.sample_unrecorded", {
        shown: number(rates.shown),
        matched: number(rates.matched),
      })
    : t(isFiltered(search) ? "trace.page.whole" : "trace.page.whole_all", { rate: number(rates.seen) });
  return (
    <footer className={classes.status} data-testid="trace-status">
      <span data-sampled={rates.sampled} className={classes.share} data-testid="trace-share">
        {share}
      </span>
      <span className={classes.spacer} />
      {trace.fetching && <span>{t("trace.page.loading_older")}</span>}
      {reached(view.reachedNs, view.older, t)}
      {view.source === "recording" && <span>{t("trace.page.from_recording")}</span>}
      <span className={classes.run} data-paused={paused} data-testid="trace-run">
        {paused ? <IconPlayerPause size={14} aria-hidden /> : <IconPlayerPlay size={14} aria-hidden />}
        {t(paused ? "trace.page.paused" : recorded ? "trace.page.at_cursor" : "trace.page.live")}
        {paused && view.arrived > 0 && (
          <em data-testid="trace-arrived">{t("trace.page.paused_hint", { count: view.arrived })}</em>
        )}
      </span>
    </footer>
  );
}

function reached(reachedNs: number | null, older: boolean, t: Translate) {
  if (!older) return <span>{t("trace.page.no_older")}</span>;
  if (reachedNs === null) return null;
  return <span>{t("trace.page.looked_back", { time: timeOfDay(reachedNs / 1e6) })}</span>;
}
