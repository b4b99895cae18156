import "uplot/dist/uPlot.min.css";
import { useComputedColorScheme } from "@mantine/core";
import { type KeyboardEvent, type PointerEvent, useEffect, useRef, useState } from "react";
import UPlot from "uplot";
import { localise } from "../../../model/values";
import { useTexts } from "../../../texts/texts";
import classes from "./Scope.module.css";
import { nearest, next } from "./nearest";
import { axisOf, coloursOf, labels } from "./ScopePlot";
import { useWidth } from "./ScopePlots";

const LEFT_PX = 64;
const MARGIN = 0.06;
/** What hardly changes is not blown up: half the axis spans this share of it at least. */
const FLAT = 0.005;
/** What is finer than any object resolves is noise of the computation; its labels would not fit either. */
const LEAST = 1e-3;
/** So many points at most are dots as well. */
const DOTS = 3000;
const DOT_PX = 2;

interface Props {
  /** Points that are joined in their order; null breaks the line. */
  x: readonly (number | null)[];
  y: readonly (number | null)[];
  colour: number;
  label: string;
  xUnit: string;
  yUnit: string;
  /** The axis begins at 0, as amplitudes do. */
  fromZero: boolean;
  drawn: Map<string, UPlot>;
  name: string;
}

/** One curve over any axis: a spectrum, or one signal over another. Pointer and arrow keys read its points. */
export function Chart({ x, y, colour, label, xUnit, yUnit, fromZero, drawn, name }: Props) {
  const t = useTexts();
  const scheme = useComputedColorScheme();
  const holder = useRef<HTMLDivElement>(null);
  const width = useWidth(holder);
  const [reading, setReading] = useState<{ of: typeof x; at: number | null } | null>(null);
  const at = reading?.of === x ? reading.at : null;
  const setAt = (point: number | null) => setReading({ of: x, at: point });
  useEffect(() => {
    const element = holder.current;
    if (!element || width === 0) return;
    const show = (text: string) => localise(text, t.language);
    const axis = axisOf(element);
    const paint = (made: UPlot) => paintCurve(made, x, y, coloursOf(element)[colour] ?? "", !fromZero);
    const made = new UPlot(
      {
        width,
        height: element.clientHeight,
        legend: { show: false },
        cursor: { show: false },
        padding: [18, 14, 0, 0],
        scales: {
          x: { time: false, range: rangeOf(x, fromZero) },
          y: { range: rangeOf(y, fromZero) },
        },
        axes: [
          { ...axis, size: 24, space: 70, values: (_made, splits) => labels(splits).map(show) },
          { ...axis, size: LEFT_PX, space: 28, values: (_made, splits) => labels(splits).map(show) },
        ],
        series: [{}, { show: true, auto: false }],
        hooks: { draw: [paint] },
      },
      [
        [0, 1],
        [null, null],
      ],
      element,
    );
    drawn.set(name, made);
    const observer = new ResizeObserver(() => made.setSize({ width, height: element.clientHeight }));
    observer.observe(element);
    return () => {
      observer.disconnect();
      drawn.delete(name);
      made.destroy();
    };
  }, [x, y, colour, fromZero, width, scheme, t, drawn, name]);
  const point = (event: PointerEvent) => {
    const made = drawn.get(name);
    if (!made) return;
    const box = made.over.getBoundingClientRect();
    const [left, top] = [event.clientX - box.left, event.clientY - box.top];
    setAt(nearest(x, y, (value, scale) => made.valToPos(value, scale), left, top, fromZero));
  };
  const step = (event: KeyboardEvent) => {
    if (event.key !== "ArrowLeft" && event.key !== "ArrowRight") return;
    event.preventDefault();
    setAt(next(x, y, at, event.key === "ArrowRight" ? 1 : -1));
  };
  const [atX, atY] = at === null ? [null, null] : [x[at] ?? null, y[at] ?? null];
  const read = (value: number) => localise(value.toPrecision(4).replace("-", "−"), t.language);
  const readX = (value: number) => (fromZero ? `${read(value)} ${xUnit}` : `${xUnit}: ${read(value)}`);
  return (
    <figure className={classes.chart}>
      <div
        ref={holder}
        className={classes.chartCanvas}
        role="group"
        tabIndex={0}
        aria-label={label}
        data-testid={`scope-${name}`}
        onPointerMove={point}
        onPointerLeave={() => setAt(null)}
        onKeyDown={step}
        onBlur={() => setAt(null)}
      >
        <span className={classes.unit}>{yUnit}</span>
        <Point made={drawn.get(name)} x={atX} y={atY} />
      </div>
      <figcaption className={classes.axis} aria-live="polite" data-testid={`read-${name}`}>
        {atX === null || atY === null ? xUnit : `${readX(atX)} · ${read(atY)} ${yUnit}`.trim()}
      </figcaption>
    </figure>
  );
}

/** The point that is read, with a line down to its axis. */
function Point({ made, x, y }: { made: UPlot | undefined; x: number | null; y: number | null }) {
  if (!made || x === null || y === null) return null;
  const [left, top] = [made.over.offsetLeft + made.valToPos(x, "x"), made.over.offsetTop];
  const down = made.valToPos(y, "y");
  return (
    <>
      <span className={classes.readLine} style={{ left, top, height: made.over.offsetHeight }} />
      <span className={classes.readPoint} style={{ left, top: top + down }} />
    </>
  );
}

function rangeOf(values: readonly (number | null)[], fromZero: boolean): [number, number] {
  let [low, high] = [Infinity, -Infinity];
  for (const one of values) {
    if (one === null) continue;
    if (one < low) low = one;
    if (one > high) high = one;
  }
  if (low > high) return [0, 1];
  if (fromZero) return [0, high + Math.max(high, LEAST) * MARGIN];
  const half = Math.max((high - low) * (0.5 + MARGIN), Math.abs(high) * FLAT, LEAST);
  const middle = (low + high) / 2;
  return [middle - half, middle + half];
}

function paintCurve(
  made: UPlot,
  x: readonly (number | null)[],
  y: readonly (number | null)[],
  colour: string,
  dots: boolean,
): void {
  const { ctx: brush, bbox } = made;
  brush.save();
  brush.beginPath();
  brush.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  brush.clip();
  brush.beginPath();
  let open = false;
  x.forEach((at, n) => {
    const value = y[n] ?? null;
    if (at === null || value === null) {
      open = false;
      return;
    }
    const [left, top] = [made.valToPos(at, "x", true), made.valToPos(value, "y", true)];
    if (open) brush.lineTo(left, top);
    else brush.moveTo(left, top);
    open = true;
  });
  brush.strokeStyle = colour;
  brush.lineWidth = 1.6 * devicePixelRatio;
  brush.lineJoin = "round";
  brush.stroke();
  if (dots && x.length <= DOTS) {
    brush.fillStyle = colour;
    x.forEach((at, n) => {
      const value = y[n] ?? null;
      if (at === null || value === null) return;
      brush.beginPath();
      brush.arc(
        made.valToPos(at, "x", true),
        made.valToPos(value, "y", true),
        DOT_PX * devicePixelRatio,
        0,
        2 * Math.PI,
      );
      brush.fill();
    });
  }
  brush.restore();
}
