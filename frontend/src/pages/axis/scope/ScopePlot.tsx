import "uplot/dist/uPlot.min.css";
import { useComputedColorScheme } from "@mantine/core";
import { useEffect, useRef } from "react";
import UPlot from "uplot";
import type { KeptMark } from "../../../api/scope";
import { indexAt, type Track } from "../../../model/tracks";
import { localise } from "../../../model/values";
import { useTexts } from "../../../texts/texts";
import { type Area, paintTrack } from "../../recordings/desk/paint";
import classes from "./Scope.module.css";
import { BITS, COLOURS, laneValue, limitsOf, namesIn, type PlotGroup, type Trace } from "./traces";
import type { Pair } from "./view";

export const LEFT_PX = 64;
export const RIGHT_PX = 12;
const BOTTOM_PX = 24;
/** Below a plot that is not the last: its axis of time is the last one's. */
const NARROW_PX = 8;
const TOP_PX = 7;
const LINE_PX = 1.6;
const REFERENCE_PX = 1.2;
/** Single values are dots where they lie at least so far apart. */
const DOTS_PX = 7;
const DOT_PX = 2.2;

interface Props {
  group: PlotGroup;
  view: Pair;
  /** Limits of the axis that were set by hand. */
  scale: Pair | null;
  endS: number;
  width: number;
  marks: readonly { atS: number; what: KeptMark["what"] }[];
  label: string;
  /** Has the axis of time. */
  last: boolean;
  onMade: (key: string, made: UPlot | null) => void;
}

/** The signals of one unit, or bits in lanes. Between two values the last one holds: nothing is drawn that was not seen. */
export function ScopePlot({ group, view, scale, endS, width, marks, label, last, onMade }: Props) {
  const t = useTexts();
  const scheme = useComputedColorScheme();
  const holder = useRef<HTMLDivElement>(null);
  const drawn = useRef<UPlot | null>(null);
  const scene = useRef<Props | null>(null);
  const { key } = group;
  useEffect(() => {
    scene.current = { group, view, scale, endS, width, marks, label, last, onMade };
    if (drawn.current) rescale(drawn.current, scene.current);
  });
  useEffect(() => {
    const element = holder.current;
    if (!element || width === 0) return;
    const paint = (made: UPlot) => {
      if (scene.current) paintScene(made, scene.current, element);
    };
    const show = (text: string) => localise(text, t.language);
    const made = new UPlot(
      optionsOf(element, width, { lanes: key === BITS, last }, show, paint),
      [
        [0, 1],
        [null, null],
      ],
      element,
    );
    drawn.current = made;
    onMade(key, made);
    if (scene.current) rescale(made, scene.current);
    const observer = new ResizeObserver(() => made.setSize({ width, height: element.clientHeight }));
    observer.observe(element);
    return () => {
      observer.disconnect();
      onMade(key, null);
      made.destroy();
      drawn.current = null;
    };
  }, [key, width, scheme, t, last, onMade]);
  return (
    <div
      ref={holder}
      className={classes.canvas}
      role="img"
      aria-label={label}
      data-plot
      data-last={last}
      data-testid={`scope-plot-${key}`}
    />
  );
}

function rescale(made: UPlot, { group, view, scale }: Props): void {
  const [min, max] = scale ?? limitsOf(group, view[0], view[1]);
  made.batch(() => {
    made.setScale("x", { min: view[0], max: view[1] });
    made.setScale("y", { min, max });
  });
}

export function coloursOf(element: HTMLElement): string[] {
  const style = getComputedStyle(element);
  return Array.from({ length: COLOURS }, (_, at) => style.getPropertyValue(`--scope-${at}`).trim());
}

function paintScene(made: UPlot, { group, endS, marks, view }: Props, element: HTMLElement): void {
  const { ctx: brush, bbox } = made;
  const { min, max } = made.scales.y ?? {};
  if (min == null || max == null) return;
  const style = getComputedStyle(element);
  const colours = coloursOf(element);
  const x = (timeS: number) => bbox.left + ((timeS - view[0]) / (view[1] - view[0])) * bbox.width;
  const y = (value: number) => bbox.top + bbox.height * (1 - (value - min) / (max - min));
  brush.save();
  brush.beginPath();
  brush.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  brush.clip();
  for (const mark of marks)
    vertical(brush, x(mark.atS), bbox, style.getPropertyValue("--scope-mark").trim(), [2, 3]);
  vertical(brush, x(0), bbox, style.getPropertyValue("--hs-dim").trim(), [6, 3]);
  const area: Area = { brush, x, fromS: view[0], toS: view[1], endS };
  const names = namesIn(group);
  for (const trace of group.traces.toReversed()) {
    const lane = names.indexOf(trace.name);
    const place = group.key === BITS ? (value: number) => y(laneValue(lane, names.length, value)) : y;
    paintTrace(area, trace, place, colours[trace.colour] ?? "", bbox.width);
  }
  if (group.key === BITS) paintNames(made, group, y, colours, style);
  brush.restore();
}

function paintTrace(
  area: Area,
  trace: Trace,
  y: (value: number) => number,
  colour: string,
  widthPx: number,
): void {
  const width = trace.reference === null ? LINE_PX : REFERENCE_PX;
  paintTrack(area, trace.track, y, { colour, dash: trace.dash, width, held: true });
  if (trace.reference === null && trace.track.exact) paintDots(area, trace.track, y, colour, widthPx);
}

function paintDots(
  { brush, x, fromS, toS }: Area,
  track: Track,
  y: (v: number) => number,
  colour: string,
  px: number,
) {
  const first = Math.max(0, indexAt(track.t, fromS));
  const last = indexAt(track.t, toS);
  if ((last - first) * DOTS_PX * devicePixelRatio > px) return;
  brush.fillStyle = colour;
  for (let at = first; at <= last; at += 1) {
    const value = track.low[at] ?? NaN;
    if (Number.isNaN(value)) continue;
    brush.beginPath();
    brush.arc(x(track.t[at] ?? 0), y(value), DOT_PX * devicePixelRatio, 0, 2 * Math.PI);
    brush.fill();
  }
}

function paintNames(
  made: UPlot,
  group: PlotGroup,
  y: (v: number) => number,
  colours: string[],
  style: CSSStyleDeclaration,
) {
  const { ctx: brush, bbox } = made;
  const names = namesIn(group);
  brush.font = `${11 * devicePixelRatio}px ${style.fontFamily}`;
  brush.textBaseline = "middle";
  brush.textAlign = "left";
  names.forEach((name, lane) => {
    const trace = group.traces.find((one) => one.name === name);
    if (!trace) return;
    const text = trace.label.split(": ").at(-1) ?? trace.label;
    const at = y(laneValue(lane, names.length, 0.5));
    const wide = brush.measureText(text).width + 8 * devicePixelRatio;
    brush.fillStyle = style.getPropertyValue("--hs-panel").trim();
    brush.globalAlpha = 0.8;
    brush.fillRect(bbox.left + 2, at - 8 * devicePixelRatio, wide, 16 * devicePixelRatio);
    brush.globalAlpha = 1;
    brush.fillStyle = colours[trace.colour] ?? "";
    brush.fillText(text, bbox.left + 6 * devicePixelRatio, at);
  });
}

function vertical(
  brush: CanvasRenderingContext2D,
  at: number,
  bbox: UPlot.BBox,
  colour: string,
  dash: number[],
): void {
  brush.beginPath();
  brush.moveTo(at, bbox.top);
  brush.lineTo(at, bbox.top + bbox.height);
  brush.strokeStyle = colour;
  brush.lineWidth = 1.3 * devicePixelRatio;
  brush.setLineDash(dash.map((one) => one * devicePixelRatio));
  brush.stroke();
  brush.setLineDash([]);
}

function optionsOf(
  element: HTMLElement,
  width: number,
  { lanes, last }: { lanes: boolean; last: boolean },
  show: (text: string) => string,
  paint: (made: UPlot) => void,
): UPlot.Options {
  const axis = axisOf(element);
  return {
    width,
    height: element.clientHeight,
    legend: { show: false },
    cursor: { show: false },
    padding: [TOP_PX, RIGHT_PX, 0, 0],
    scales: { x: { time: false, auto: false }, y: { auto: false } },
    axes: [
      {
        ...axis,
        size: last ? BOTTOM_PX : NARROW_PX,
        gap: 3,
        space: 70,
        values: (_made, splits) => (last ? labels(splits).map(show) : splits.map(() => "")),
      },
      {
        ...axis,
        size: LEFT_PX,
        gap: 5,
        space: 26,
        grid: { ...axis.grid, show: !lanes },
        values: (_made, splits) => (lanes ? splits.map(() => "") : labels(splits).map(show)),
      },
    ],
    series: [{}, { show: true, auto: false }],
    hooks: { draw: [paint] },
  };
}

export function axisOf(element: HTMLElement): UPlot.Axis {
  const style = getComputedStyle(element);
  const colour = (name: string) => style.getPropertyValue(name).trim();
  return {
    stroke: colour("--hs-dim"),
    font: `11px ${style.fontFamily}`,
    grid: { stroke: colour("--hs-line"), width: 1 },
    ticks: { show: false },
  };
}

/** All with as many decimals as the distance between two asks for. */
export function labels(splits: readonly number[]): string[] {
  const apart = Math.abs((splits[1] ?? 1) - (splits[0] ?? 0)) || 1;
  const whole = (count: number) =>
    Math.abs(apart * 10 ** count - Math.round(apart * 10 ** count)) < 1e-6 && apart * 10 ** count > 0.5;
  const decimals = [0, 1, 2, 3, 4, 5, 6, 7, 8].find(whole) ?? 9;
  return splits.map((at) => at.toFixed(decimals).replace("-", "−"));
}
