import { useQuery } from "@tanstack/react-query";
import { type ReactNode, useMemo, useState } from "react";
import type UPlot from "uplot";
import { isArmed, liveQuery, type ScopeLine } from "../../../api/scope";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { useDeviceName } from "../../../ui/devices";
import { Measure } from "./Measure";
import classes from "./Scope.module.css";
import { ScopePlots } from "./ScopePlots";
import { EACH, groupsOf, tracesOf } from "./traces";

const NO_MARKS: readonly never[] = [];

/** What comes in just now, while the scope is armed; else `children`. */
export function LiveView({ line, children }: { line: ScopeLine | undefined; children: ReactNode }) {
  const t = useTexts();
  const armed = isArmed(line);
  const deviceName = useDeviceName();
  const { data } = useQuery(liveQuery(armed));
  const [hoverS, setHoverS] = useState<number | null>(null);
  const [drawn] = useState(() => new Map<string, UPlot>());
  const signals = line?.signals;
  const traces = useMemo(
    () => (data && signals ? tracesOf(signals, data.series, deviceName, t) : []),
    [data, signals, deviceName, t],
  );
  const [search] = usePageSearch();
  const groups = useMemo(() => groupsOf(traces, search.axes === EACH), [traces, search.axes]);
  if (!armed) return children;
  if (!data || traces.length === 0) return <p className={classes.empty}>{t("page.scope.empty_waiting")}</p>;
  return (
    <div className={classes.shown} data-testid="scope-live">
      <ScopePlots
        groups={groups}
        whole={[-data.span_s, 0]}
        view={[-data.span_s, 0]}
        endS={0}
        marks={NO_MARKS}
        cursors={null}
        still={false}
        hoverS={hoverS}
        onHover={setHoverS}
        onView={() => undefined}
        onCursors={() => undefined}
        drawn={drawn}
      />
      <Measure traces={traces} cursors={null} hoverS={hoverS ?? 0} onCursors={() => undefined} />
    </div>
  );
}
