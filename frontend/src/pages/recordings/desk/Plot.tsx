import "uplot/dist/uPlot.min.css";
import { useComputedColorScheme } from "@mantine/core";
import { memo, useEffect, useMemo, useRef } from "react";
import UPlot from "uplot";
import { disagreement, joined, type Span, spanIn, type Track } from "../../../model/tracks";
import { localise } from "../../../model/values";
import { type Stretch, useLooking } from "../../../replay/looking";
import { ticksOf } from "../../../replay/timelineView";
import { useTexts } from "../../../texts/texts";
import classes from "./Desk.module.css";
import { looksOf, unitsOf } from "./looks";
import { type Area, paintBand, paintTrack } from "./paint";
import { areaPx, LEFT_PX, type Room, rightPx, secondsOf } from "./place";
import type { DeskSignal } from "./signals";
import type { PlotSpec } from "./view";

export const TICK_PX = 92;
const AXIS_PX = 48;
const RIGHT = 1;
const LEFT = 3;
const LINE_PX = 1.5;
/** Scales never close in below so many of the smallest steps of a value, so that noise does not look like motion. */
const LEAST_STEPS = 20;
const MARGIN = 0.07;

interface Props {
  plot: PlotSpec;
  signals: readonly DeskSignal[];
  tracks: ReadonlyMap<string, Track>;
  whole: Stretch;
  room: Room;
  label: string;
}

/** One plot: axes by uPlot, signals by our own brush, for each signal has times of its own. */
export const Plot = memo(function Plot({ plot, signals, tracks, whole, room, label }: Props) {
  const { language } = useTexts();
  const looking = useLooking();
  const scheme = useComputedColorScheme();
  const holder = useRef<HTMLDivElement>(null);
  const drawn = useRef<UPlot | null>(null);
  const units = useMemo(() => unitsOf(signals), [signals]);
  const band = useMemo(() => {
    const own = signals.filter((one) => one.unit === units[0]).flatMap(({ name }) => tracks.get(name) ?? []);
    return plot.band && own.length > 1 ? disagreement(own, -Infinity, Infinity) : null;
  }, [plot.band, signals, units, tracks]);
  const scene = useRef<Scene | null>(null);
  useEffect(() => {
    scene.current = { plot, signals, units, tracks, band, whole };
  });

  useEffect(() => {
    const element = holder.current;
    if (!element || room.width === 0) return;
    const paint = (made: UPlot) => {
      if (scene.current) paintScene(made, scene.current, coloursOf(element));
    };
    const view = () => looking.window ?? whole;
    const show = (text: string) => localise(text, language);
    const made = new UPlot(
      options(element, units, room, whole, view, show, paint),
      [[0, 1], ...units.map(() => [null, null])],
      element,
    );
    drawn.current = made;
    const redraw = () => rescale(made, scene.current, view());
    redraw();
    const end = looking.subscribe("window", redraw);
    const observer = new ResizeObserver(() => {
      made.setSize({ width: room.width, height: element.clientHeight });
      redraw();
    });
    observer.observe(element);
    return () => {
      end();
      observer.disconnect();
      made.destroy();
      drawn.current = null;
    };
  }, [units, room, whole, looking, scheme, language]);

  useEffect(() => {
    if (drawn.current) rescale(drawn.current, scene.current, looking.window ?? whole);
  }, [plot, signals, tracks, band, looking, whole]);

  return (
    <div ref={holder} className={classes.canvas} role="img" aria-label={label} data-plot>
      {units.map((unit, at) => (
        <span
          key={unit}
          className={classes.unit}
          style={at === 0 ? { left: 6 } : { right: rightPx(room.axes) - 10 - at * AXIS_PX + 8 }}
        >
          {unit}
        </span>
      ))}
    </div>
  );
});

interface Scene {
  plot: PlotSpec;
  signals: readonly DeskSignal[];
  units: readonly string[];
  tracks: ReadonlyMap<string, Track>;
  band: Track | null;
  whole: Stretch;
}

const scaleOf = (at: number) => `unit${at}`;

interface Colours {
  lines: string[];
  band: string;
}

function coloursOf(element: HTMLElement): Colours {
  const style = getComputedStyle(element);
  const named = (name: string) => style.getPropertyValue(`--desk-${name}`).trim();
  return { lines: Array.from({ length: 8 }, (_, at) => named(String(at))), band: named("band") };
}

/** Sets all scales anew, which draws anew. */
function rescale(made: UPlot, scene: Scene | null, view: Stretch): void {
  if (scene === null) return;
  const [fromS, toS] = [secondsOf(view.fromNs, scene.whole), secondsOf(view.toNs, scene.whole)];
  made.batch(() => {
    made.setScale("x", { min: fromS, max: toS });
    scene.units.forEach((unit, at) => {
      const own = scene.signals.filter((one) => one.unit === unit);
      const spans = own.map(({ name }) => spanOf(scene.tracks.get(name), fromS, toS));
      const fixed = at === 0 ? scene.plot.range : null;
      const [min, max] = fixed ?? limits(joined(spans), Math.max(0, ...own.map((one) => one.decimals)));
      made.setScale(scaleOf(at), { min, max });
    });
  });
}

const spanOf = (track: Track | undefined, fromS: number, toS: number): Span | null =>
  track === undefined ? null : spanIn(track, fromS, toS);

function limits(span: Span | null, decimals: number): [number, number] {
  const { low, high } = span ?? { low: 0, high: 0 };
  const least = Math.max(LEAST_STEPS * 10 ** -decimals, 0.02 * Math.max(Math.abs(low), Math.abs(high)));
  const half = Math.max(least, (high - low) * (1 + 2 * MARGIN)) / 2;
  const middle = (low + high) / 2;
  return [middle - half, middle + half];
}

function paintScene(made: UPlot, { signals, units, tracks, band, whole }: Scene, colours: Colours): void {
  const { ctx: brush, bbox } = made;
  const { min, max } = made.scales.x ?? {};
  if (min == null || max == null) return;
  const area: Area = {
    brush,
    x: (timeS) => bbox.left + ((timeS - min) / (max - min)) * bbox.width,
    fromS: min,
    toS: max,
    endS: secondsOf(whole.toNs, whole),
  };
  const yOf = (at: number) => {
    const { min: low = 0, max: high = 1 } = made.scales[scaleOf(at)] ?? {};
    return (value: number) => bbox.top + bbox.height * (1 - (value - low) / (high - low));
  };
  const looks = looksOf(signals);
  brush.save();
  brush.beginPath();
  brush.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  brush.clip();
  if (band) paintBand(area, band, yOf(0), colours.band);
  // The first signals lie on top: they are those that were asked for first.
  for (const signal of signals.toReversed()) {
    const [track, look] = [tracks.get(signal.name), looks.get(signal.name)];
    if (!track || !look) continue;
    const colour = colours.lines[look.colour] ?? "";
    const stroke = { colour, dash: look.dash, width: LINE_PX, held: signal.held };
    paintTrack(area, track, yOf(units.indexOf(signal.unit)), stroke);
  }
  brush.restore();
}

function options(
  element: HTMLElement,
  units: readonly string[],
  room: Room,
  whole: Stretch,
  view: () => Stretch,
  show: (text: string) => string,
  paint: (made: UPlot) => void,
): UPlot.Options {
  const style = getComputedStyle(element);
  const colour = (name: string) => style.getPropertyValue(name).trim();
  const axis: UPlot.Axis = {
    stroke: colour("--hs-dim"),
    font: `11px ${style.fontFamily}`,
    grid: { stroke: colour("--hs-line"), width: 1 },
    ticks: { show: false },
  };
  const free = rightPx(room.axes) - Math.max(0, units.length - 1) * AXIS_PX;
  return {
    width: room.width,
    height: element.clientHeight,
    legend: { show: false },
    cursor: { show: false },
    padding: [6, free, 6, 0],
    scales: {
      x: { time: false },
      ...Object.fromEntries(units.map((_, at) => [scaleOf(at), { auto: false }])),
    },
    axes: [
      {
        ...axis,
        size: 0,
        gap: 0,
        splits: () => ticksOf(view(), areaPx(room), TICK_PX).at.map((tNs) => secondsOf(tNs, whole)),
        values: (_made, splits) => splits.map(() => ""),
      },
      ...units.map((_, at): UPlot.Axis => ({
        ...axis,
        scale: scaleOf(at),
        // eslint-disable-next-line @typescript-eslint/no-unsafe-enum-assignment -- the library's enum exists in its types alone
        side: at === 0 ? LEFT : RIGHT,
        size: at === 0 ? LEFT_PX : AXIS_PX,
        gap: 5,
        space: 26,
        grid: { ...axis.grid, show: at === 0 },
        values: (_made, splits) => labels(splits).map(show),
      })),
    ],
    series: [{}, ...units.map((_, at): UPlot.Series => ({ scale: scaleOf(at), auto: false, show: true }))],
    hooks: { draw: [paint] },
  };
}

/** All with as many decimals as the distance between two asks for. */
function labels(splits: readonly number[]): string[] {
  const apart = Math.abs((splits[1] ?? 1) - (splits[0] ?? 0)) || 1;
  const whole = (count: number) => Math.abs(apart * 10 ** count - Math.round(apart * 10 ** count)) < 1e-6;
  const decimals = [0, 1, 2, 3, 4, 5].find(whole) ?? 6;
  return splits.map((at) => at.toFixed(decimals).replace("-", "−"));
}
