import "uplot/dist/uPlot.min.css";
import { Button, SegmentedControl, useComputedColorScheme } from "@mantine/core";
import { IconPlayerPause, IconPlayerPlay } from "@tabler/icons-react";
import { useCallback, useEffect, useMemo, useRef, useState } from "react";
import UPlot from "uplot";
import { usePageSearch } from "../../frame/search";
import { useStore } from "../../live/live";
import type { LiveStore } from "../../live/store";
import type { Columns, Trace } from "../../live/trace";
import type { DeviceContext } from "../../model/shown";
import { localise, quantityOf } from "../../model/values";
import { useTexts } from "../../texts/texts";
import { drawnOf, traceOf, useDeviceTrace } from "../../ui/deviceTrace";
import { whileSeen } from "../../ui/whileSeen";
import classes from "./Axis.module.css";

const REDRAW_MS = 200;
const SPANS = ["60", "120", "300"];

interface Plot {
  key: string;
  unit: string;
  /** Scales never close in below this, so that noise does not look like motion. */
  leastSpan: number;
  series: readonly { of: keyof Columns; colour: string; dash?: number[] }[];
}

const PLOTS: readonly Plot[] = [
  {
    key: "angle",
    unit: "°",
    leastSpan: 4,
    series: [
      { of: "positions", colour: "--hs-accent" },
      { of: "demands", colour: "--hs-warn", dash: [5, 4] },
    ],
  },
  { key: "velocity", unit: "°/s", leastSpan: 2, series: [{ of: "velocities", colour: "--hs-accent" }] },
  { key: "current", unit: "%", leastSpan: 10, series: [{ of: "currents", colour: "--hs-accent" }] },
];

type TraceOf = (store: LiveStore) => Trace | undefined;

export function BladePlots({ blade }: { blade: number }) {
  const traceIn = useCallback<TraceOf>((store) => store.traces.get(blade), [blade]);
  return <Plots plots={PLOTS} traceIn={traceIn} />;
}

const POSITION = PLOTS[0]?.series ?? [];
const LEAST_SPANS: Record<string, number> = { "°": 4, "°/s": 2, "%": 10 };
/** Of a unit that is counted in steps: so few are no motion. */
const LEAST_STEPS = 20;

/** Of an axis that turns no blade: what its device has, in its own units. */
export function DevicePlots({ context }: { context: DeviceContext }) {
  useDeviceTrace(context);
  const { slug, doc, lookup } = context;
  const traceIn = useCallback<TraceOf>((store) => traceOf(store, slug), [slug]);
  const drawn = useMemo(() => drawnOf({ ...context, doc }), [context, doc]);
  const units = [drawn.position, drawn.velocity, drawn.effort].map(
    (one) => one && quantityOf(one, lookup).unit,
  );
  const [positionUnit, velocityUnit, effortUnit] = units;
  const plots = useMemo(
    () =>
      [
        plotOf("position", positionUnit, POSITION),
        plotOf("velocity", velocityUnit, [{ of: "velocities", colour: "--hs-accent" }]),
        plotOf(drawn.effort?.address === "6077" ? "torque" : "current", effortUnit, [
          { of: "currents", colour: "--hs-accent" },
        ]),
      ].filter((one) => one !== null),
    [positionUnit, velocityUnit, effortUnit, drawn],
  );
  return <Plots plots={plots} traceIn={traceIn} />;
}

function plotOf(key: string, unit: string | undefined, series: Plot["series"]): Plot | null {
  return unit === undefined ? null : { key, unit, leastSpan: LEAST_SPANS[unit] ?? LEAST_STEPS, series };
}

/** Angle and demand, velocity and current of the last minutes; paused, the same stretch stays in view. */
function Plots({ plots, traceIn }: { plots: readonly Plot[]; traceIn: TraceOf }) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const store = useStore();
  const [pausedS, setPausedS] = useState<number | null>(null);
  const span = SPANS.includes(search.span ?? "") ? (search.span ?? "60") : "60";
  return (
    <>
      <h2>
        {t("page.axis.plots")}
        <span className={classes.plotTools}>
          <SegmentedControl
            size="xs"
            value={span}
            onChange={(chosen) => update({ span: chosen === "60" ? undefined : chosen })}
            data={SPANS.map((one) => ({ value: one, label: t(`page.axis.span_${one}`) }))}
            aria-label={t("page.axis.span")}
          />
          <Button
            variant="default"
            size="xs"
            h={40}
            aria-pressed={pausedS !== null}
            leftSection={
              pausedS === null ? (
                <IconPlayerPause size={16} aria-hidden />
              ) : (
                <IconPlayerPlay size={16} aria-hidden />
              )
            }
            onClick={() => setPausedS(pausedS === null ? store.serverNowMs() / 1000 : null)}
            data-testid="pause"
          >
            {t(pausedS === null ? "page.axis.pause" : "page.axis.go_on")}
          </Button>
        </span>
      </h2>
      {plots.map((plot) => (
        <OnePlot key={plot.key} plot={plot} traceIn={traceIn} spanS={Number(span)} pausedS={pausedS} />
      ))}
    </>
  );
}

interface OnePlotProps {
  plot: Plot;
  traceIn: TraceOf;
  spanS: number;
  pausedS: number | null;
}

function OnePlot({ plot, traceIn, spanS, pausedS }: OnePlotProps) {
  const t = useTexts();
  const { language } = t;
  const store = useStore();
  const holder = useRef<HTMLDivElement>(null);
  const scheme = useComputedColorScheme();
  useEffect(() => {
    const element = holder.current;
    if (!element) return;
    const endS = () => pausedS ?? store.serverNowMs() / 1000;
    const data = (): UPlot.AlignedData => {
      const found = traceIn(store)?.columns(spanS, endS());
      return found
        ? [found.times, ...plot.series.map((one) => found[one.of])]
        : [[], ...plot.series.map(() => [])];
    };
    const show = (text: string) => localise(text, language);
    const drawn = new UPlot(options(element, plot, spanS, endS, show), data(), element);
    let shown = "";
    const redraw = () => {
      const now = data();
      // The cursor of a recording may stand still: then nothing is to be drawn.
      const what = `${endS()} ${now[0].length} ${now[0].at(-1) ?? ""}`;
      if (what !== shown) drawn.setData(now);
      shown = what;
    };
    const ends = pausedS === null ? whileSeen(element, REDRAW_MS, redraw) : null;
    const observer = new ResizeObserver(() =>
      drawn.setSize({ width: element.clientWidth, height: element.clientHeight }),
    );
    observer.observe(element);
    return () => {
      ends?.();
      observer.disconnect();
      drawn.destroy();
    };
  }, [plot, traceIn, store, spanS, pausedS, scheme, language]);
  const title = t(`page.axis.plot.${plot.key}`);
  return (
    <figure className={classes.plot}>
      <figcaption>
        {title} <span className="dim">{plot.unit}</span>
        {plot.series.length > 1 && <span className={classes.legend}>{t("page.axis.demand_dashed")}</span>}
      </figcaption>
      <div
        ref={holder}
        className={classes.plotBody}
        role="img"
        aria-label={title}
        data-testid={`plot-${plot.key}`}
      />
    </figure>
  );
}

function options(
  element: HTMLElement,
  plot: Plot,
  spanS: number,
  endS: () => number,
  show: (text: string) => string,
): UPlot.Options {
  const style = getComputedStyle(element);
  const colour = (name: string) => style.getPropertyValue(name).trim();
  const marks = [0.75, 0.5, 0.25, 0].map((part) => part * spanS);
  const axis: UPlot.Axis = {
    stroke: colour("--hs-dim"),
    font: `11px ${style.fontFamily}`,
    grid: { stroke: colour("--hs-line"), width: 1 },
    ticks: { show: false },
  };
  return {
    width: element.clientWidth,
    height: element.clientHeight,
    legend: { show: false },
    cursor: { show: false },
    padding: [6, 14, 0, 0],
    scales: {
      x: { time: false, range: () => [endS() - spanS, endS()] },
      y: { range: (_plot, low, high) => spanOf(low, high, plot.leastSpan) },
    },
    axes: [
      {
        ...axis,
        size: 18,
        gap: 2,
        splits: () => marks.map((ago) => endS() - ago),
        values: () => marks.map((ago) => `${ago === 0 ? "" : "−"}${show(String(ago))} s`),
      },
      {
        ...axis,
        size: 46,
        gap: 4,
        space: 24,
        values: (_plot, splits) => {
          const decimals = splits.every((at) => Number.isInteger(at)) ? 0 : 1;
          return splits.map((at) => show(at.toFixed(decimals)));
        },
      },
    ],
    series: [
      {},
      ...plot.series.map(({ colour: name, dash }): UPlot.Series => ({
        stroke: colour(name),
        width: dash ? 1.25 : 2,
        points: { show: false },
        ...(dash ? { dash } : {}),
      })),
    ],
  };
}

function spanOf(low: number | null, high: number | null, least: number): [number, number] {
  if (low === null || high === null) return [-least / 2, least / 2];
  const half = Math.max(least, (high - low) * 1.15) / 2;
  const middle = (low + high) / 2;
  return [middle - half, middle + half];
}
