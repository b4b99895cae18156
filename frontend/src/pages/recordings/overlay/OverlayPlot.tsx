import "uplot/dist/uPlot.min.css";
import { useComputedColorScheme } from "@mantine/core";
import { type MouseEvent, useEffect, useRef } from "react";
import UPlot from "uplot";
import { joined, spanAt, spanIn } from "../../../model/tracks";
import { localise } from "../../../model/values";
import { useTexts } from "../../../texts/texts";
import { type Area, paintTrack } from "../desk/paint";
import type { Span } from "./choice";
import { COLOURS, type Curve, type OverlayPlot as Plot } from "./curves";
import classes from "./Overlay.module.css";
import { msText, useOpenAt } from "./reading";

const LEFT_PX = 58;
const RIGHT_PX = 14;
const BOTTOM_PX = 26;
const TOP_PX = 8;
const LINE_PX = 1.6;
const MARGIN = 0.06;
/** A click so near a curve means that curve. */
const NEAR_PX = 14;

interface Props {
  plot: Plot;
  span: Span;
  width: number;
  hoverMs: number | null;
  onHover: (ms: number | null) => void;
}

/** One object of all recordings. A click on a curve opens its recording at that moment. */
export function OverlayPlot({ plot, span, width, hoverMs, onHover }: Props) {
  const t = useTexts();
  const open = useOpenAt();
  const scheme = useComputedColorScheme();
  const holder = useRef<HTMLDivElement>(null);
  const made = useRef<UPlot | null>(null);
  const { beforeS, afterS } = span;
  useEffect(() => {
    const element = holder.current;
    if (!element || width === 0) return;
    const style = getComputedStyle(element);
    const colours = Array.from({ length: COLOURS }, (_, at) =>
      style.getPropertyValue(`--overlay-${at}`).trim(),
    );
    const paint = (drawing: UPlot) => paintAll(drawing, plot.curves, colours, style);
    const [low, high] = limits(plot.curves, -beforeS * 1000, afterS * 1000);
    const drawing = new UPlot(
      {
        ...optionsOf(element, width, (text) => localise(text, t.language)),
        scales: { x: { time: false, range: [-beforeS * 1000, afterS * 1000] }, y: { range: [low, high] } },
        hooks: { draw: [paint] },
      },
      [
        [-beforeS * 1000, afterS * 1000],
        [null, null],
      ],
      element,
    );
    made.current = drawing;
    return () => {
      drawing.destroy();
      made.current = null;
    };
  }, [plot, beforeS, afterS, width, scheme, t]);

  const placeOf = (event: MouseEvent): { ms: number; yPx: number } | null => {
    const drawing = made.current;
    if (!drawing) return null;
    const box = drawing.over.getBoundingClientRect();
    const ms = drawing.posToVal(event.clientX - box.left, "x");
    const inside = event.clientX >= box.left && event.clientX <= box.right;
    return inside ? { ms, yPx: event.clientY - box.top } : null;
  };
  const title = plot.unit === "" ? t.nameOf(plot.title) : `${t.nameOf(plot.title)}, ${plot.unit}`;
  const share = hoverMs === null ? null : (hoverMs / 1000 + beforeS) / (beforeS + afterS);
  return (
    <figure className={classes.plot} data-testid={`overlay-plot-${plot.address}`}>
      <figcaption>
        {title} <span className="dim">{plot.address}</span>
      </figcaption>
      <div
        ref={holder}
        className={classes.canvas}
        role="img"
        aria-label={title}
        onPointerMove={(event) => onHover(placeOf(event)?.ms ?? null)}
        onPointerLeave={() => onHover(null)}
        onClick={(event) => {
          const place = placeOf(event);
          const near = place && made.current && nearest(made.current, plot.curves, place);
          if (near) open(near.recording, place.ms);
        }}
      >
        {share !== null && (
          <span
            className={classes.hover}
            style={{ left: LEFT_PX + share * (width - LEFT_PX - RIGHT_PX) }}
            aria-hidden
          />
        )}
      </div>
    </figure>
  );
}

function limits(curves: readonly Curve[], fromMs: number, toMs: number): [number, number] {
  const { low, high } = joined(curves.map(({ track }) => spanIn(track, fromMs, toMs))) ?? { low: 0, high: 1 };
  const apart = Math.max(high - low, Math.abs(high) * 0.002, 1e-3);
  return [low - apart * MARGIN, high + apart * MARGIN];
}

function nearest(made: UPlot, curves: readonly Curve[], at: { ms: number; yPx: number }): Curve | null {
  const found = curves.flatMap((curve) => {
    const span = spanAt(curve.track, at.ms);
    if (span === null) return [];
    const [top, bottom] = [made.valToPos(span.high, "y"), made.valToPos(span.low, "y")];
    const px = Math.max(0, top - at.yPx, at.yPx - bottom);
    return px <= NEAR_PX ? [{ curve, px }] : [];
  });
  return found.sort((a, b) => a.px - b.px)[0]?.curve ?? null;
}

function paintAll(
  made: UPlot,
  curves: readonly Curve[],
  colours: readonly string[],
  style: CSSStyleDeclaration,
): void {
  const { ctx: brush, bbox } = made;
  const { min, max } = made.scales.x ?? {};
  if (min == null || max == null) return;
  const x = (ms: number) => bbox.left + ((ms - min) / (max - min)) * bbox.width;
  const y = (value: number) => made.valToPos(value, "y", true);
  brush.save();
  brush.beginPath();
  brush.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  brush.clip();
  paintZero(brush, x(0), bbox, style.getPropertyValue("--hs-dim").trim());
  for (const { recording, track, colour, dash, held } of curves.toReversed()) {
    // Nothing is known of a recording after its end.
    const area: Area = { brush, x, fromS: min, toS: max, endS: recording.to_ms };
    paintTrack(area, track, y, { colour: colours[colour] ?? "", dash, width: LINE_PX, held });
  }
  brush.restore();
}

function paintZero(brush: CanvasRenderingContext2D, at: number, bbox: UPlot.BBox, colour: string): void {
  brush.beginPath();
  brush.moveTo(at, bbox.top);
  brush.lineTo(at, bbox.top + bbox.height);
  brush.strokeStyle = colour;
  brush.lineWidth = 1.5 * devicePixelRatio;
  brush.stroke();
}

function optionsOf(element: HTMLElement, width: number, show: (text: string) => string) {
  const style = getComputedStyle(element);
  const colour = (name: string) => style.getPropertyValue(name).trim();
  const axis: UPlot.Axis = {
    stroke: colour("--hs-dim"),
    font: `11px ${style.fontFamily}`,
    grid: { stroke: colour("--hs-line"), width: 1 },
    ticks: { show: false },
  };
  return {
    width,
    height: element.clientHeight,
    legend: { show: false },
    cursor: { show: false },
    padding: [TOP_PX, RIGHT_PX, 0, 0] as UPlot.Padding,
    axes: [
      {
        ...axis,
        size: BOTTOM_PX,
        space: 80,
        values: (_made: UPlot, splits: number[]) => splits.map(msText(show)),
      },
      {
        ...axis,
        size: LEFT_PX,
        space: 28,
        values: (_made: UPlot, splits: number[]) => labels(splits).map(show),
      },
    ],
    series: [{}, { show: true, auto: false }],
  };
}

/** All with as many decimals as the distance between two asks for. */
function labels(splits: readonly number[]): string[] {
  const apart = Math.abs((splits[1] ?? 1) - (splits[0] ?? 0)) || 1;
  const decimals = Math.max(0, Math.min(6, Math.ceil(-Math.log10(apart) - 1e-9)));
  return splits.map((at) => at.toFixed(decimals).replace("-", "−"));
}
