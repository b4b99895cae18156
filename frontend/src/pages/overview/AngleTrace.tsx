import "uplot/dist/uPlot.min.css";
import { useComputedColorScheme } from "@mantine/core";
import { useEffect, useRef } from "react";
import UPlot from "uplot";
import { useStore } from "../../live/live";
import { TRACE_S } from "../../live/trace";
import { useTexts } from "../../texts/texts";
import { localise } from "../../model/values";
import { whileSeen } from "../../ui/whileSeen";
import classes from "./Overview.module.css";

const REDRAW_MS = 200;
const MARKS_S = [45, 30, 15, 0];
/** The scale never closes in below this, so that noise of a still blade does not look like motion. */
const LEAST_SPAN_DEG = 4;

/** Angle (line) and demand (dashes) of the last minute. Gaps stay gaps. */
export function AngleTrace({ blade, label }: { blade: number; label: string }) {
  const t = useTexts();
  const { language } = t;
  const store = useStore();
  const holder = useRef<HTMLDivElement>(null);
  const scheme = useComputedColorScheme();
  useEffect(() => {
    const element = holder.current;
    if (!element) return;
    const columns = (): UPlot.AlignedData => {
      const found = store.traces.get(blade)?.columns(TRACE_S);
      return found ? [found.times, found.positions, found.demands] : [[], [], []];
    };
    const plot = new UPlot(
      options(
        element,
        () => store.serverNowMs() / 1000,
        (text) => localise(text, language),
      ),
      columns(),
      element,
    );
    const ends = whileSeen(element, REDRAW_MS, () => plot.setData(columns()));
    const observer = new ResizeObserver(() => plot.setSize(sizeOf(element)));
    observer.observe(element);
    return () => {
      ends();
      observer.disconnect();
      plot.destroy();
    };
  }, [blade, store, scheme, language]);
  return <div ref={holder} className={classes.trace} role="img" aria-label={label} />;
}

function options(element: HTMLElement, nowS: () => number, show: (text: string) => string): UPlot.Options {
  const style = getComputedStyle(element);
  const colour = (name: string) => style.getPropertyValue(name).trim();
  const axis: UPlot.Axis = {
    stroke: colour("--hs-dim"),
    font: `11px ${style.fontFamily}`,
    grid: { stroke: colour("--hs-line"), width: 1 },
    ticks: { show: false },
  };
  return {
    ...sizeOf(element),
    legend: { show: false },
    cursor: { show: false },
    padding: [6, 14, 0, 0],
    scales: {
      x: { time: false, range: () => [nowS() - TRACE_S, nowS()] },
      y: { range: (_plot, low, high) => spanOf(low, high) },
    },
    axes: [
      {
        ...axis,
        size: 18,
        gap: 2,
        splits: (_plot, _axis, _low, now) => MARKS_S.map((ago) => now - ago),
        values: () => MARKS_S.map((ago) => `${ago === 0 ? "" : "−"}${ago} s`),
      },
      {
        ...axis,
        size: 40,
        gap: 4,
        space: 26,
        values: (_plot, splits) => degrees(splits, show),
      },
    ],
    series: [
      {},
      { stroke: colour("--hs-accent"), width: 2, points: { show: false } },
      { stroke: colour("--hs-warn"), width: 1.25, dash: [5, 4], points: { show: false } },
    ],
  };
}

/** All marks with the same count of decimals. */
function degrees(splits: number[], show: (text: string) => string): string[] {
  const decimals = splits.every((at) => Number.isInteger(at)) ? 0 : 1;
  return splits.map((at) => `${show(at.toFixed(decimals))}°`);
}

function sizeOf(element: HTMLElement): { width: number; height: number } {
  return { width: element.clientWidth, height: element.clientHeight };
}

function spanOf(low: number | null, high: number | null): [number, number] {
  if (low === null || high === null) return [0, 90];
  const middle = (low + high) / 2;
  const half = Math.max(LEAST_SPAN_DEG, (high - low) * 1.15) / 2;
  return [middle - half, middle + half];
}
