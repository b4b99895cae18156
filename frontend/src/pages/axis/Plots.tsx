import "uplot/dist/uPlot.min.css";
import { Button, SegmentedControl, useComputedColorScheme } from "@mantine/core";
import { IconPlayerPause, IconPlayerPlay } from "@tabler/icons-react";
import { useEffect, useRef, useState } from "react";
import UPlot from "uplot";
import { usePageSearch } from "../../frame/search";
import { useStore } from "../../live/live";
import type { Columns } from "../../live/trace";
import { localise } from "../../model/values";
import { useTexts } from "../../texts/texts";
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

/** Angle and demand, velocity and current of the last minutes; paused, the same stretch stays in view. */
export function Plots({ blade }: { blade: number }) {
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
      {PLOTS.map((plot) => (
        <OnePlot key={plot.key} plot={plot} blade={blade} spanS={Number(span)} pausedS={pausedS} />
      ))}
    </>
  );
}

interface OnePlotProps {
  plot: Plot;
  blade: number;
  spanS: number;
  pausedS: number | null;
}

function OnePlot({ plot, blade, spanS, pausedS }: OnePlotProps) {
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
      const found = store.traces.get(blade)?.columns(spanS, endS());
      return found
        ? [found.times, ...plot.series.map((one) => found[one.of])]
        : [[], ...plot.series.map(() => [])];
    };
    const show = (text: string) => localise(text, language);
    const drawn = new UPlot(options(element, plot, spanS, endS, show), data(), element);
    const timer = pausedS === null ? setInterval(() => drawn.setData(data()), REDRAW_MS) : null;
    const observer = new ResizeObserver(() =>
      drawn.setSize({ width: element.clientWidth, height: element.clientHeight }),
    );
    observer.observe(element);
    return () => {
      if (timer !== null) clearInterval(timer);
      observer.disconnect();
      drawn.destroy();
    };
  }, [plot, blade, store, spanS, pausedS, scheme, language]);
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
