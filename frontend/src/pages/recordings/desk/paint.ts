/** Draws signals into the area of a plot: lines, steps, bands of least and greatest; nothing across a break. */
import { indexAt, type Track } from "../../../model/tracks";

export interface Area {
  brush: CanvasRenderingContext2D;
  /** Pixels of the canvas of a time in s. */
  x: (timeS: number) => number;
  fromS: number;
  toS: number;
  /** Nothing is known after this. */
  endS: number;
}

export interface Stroke {
  colour: string;
  dash: readonly number[];
  width: number;
  /** Between two values the last one holds. */
  held: boolean;
}

export function paintTrack(area: Area, track: Track, y: (value: number) => number, stroke: Stroke): void {
  const { brush } = area;
  brush.beginPath();
  if (track.exact) tracePoints(area, track, y, stroke.held);
  else traceBuckets(area, track, y, stroke.held);
  brush.strokeStyle = stroke.colour;
  brush.lineWidth = stroke.width * devicePixelRatio;
  brush.setLineDash(stroke.dash.map((one) => one * devicePixelRatio));
  brush.lineJoin = "round";
  brush.stroke();
  brush.setLineDash([]);
}

const first = ({ t }: Track, fromS: number) => Math.max(0, indexAt(t, fromS));

function tracePoints(
  { brush, x, fromS, toS, endS }: Area,
  track: Track,
  y: (v: number) => number,
  held: boolean,
) {
  const { t, low } = track;
  const start = first(track, fromS);
  const last = Math.min(t.length - 1, indexAt(t, toS) + 1);
  let open = false;
  let before = 0;
  for (let at = start; at <= last; at += 1) {
    const [timeS, value] = [t[at] ?? 0, low[at] ?? NaN];
    if (open && held) brush.lineTo(x(timeS), before);
    if (Number.isNaN(value)) {
      open = false;
      continue;
    }
    const to = y(value);
    if (open) brush.lineTo(x(timeS), to);
    else brush.moveTo(x(timeS), to);
    open = true;
    before = to;
  }
  // What comes seldom holds until more is known.
  if (open && held && last === t.length - 1) brush.lineTo(x(Math.min(endS, toS)), before);
}

function traceBuckets({ brush, x, fromS, toS }: Area, track: Track, y: (v: number) => number, held: boolean) {
  const { t, low, high, bucketS } = track;
  const last = Math.min(t.length - 1, indexAt(t, toS) + 1);
  let open = false;
  let before = 0;
  for (let at = first(track, fromS); at <= last; at += 1) {
    const [timeS, least] = [t[at] ?? 0, low[at] ?? NaN];
    if (Number.isNaN(least)) {
      if (open && held) brush.lineTo(x(timeS), before);
      open = false;
      continue;
    }
    const [bottom, top] = [y(least), y(high[at] ?? least)];
    const middle = x(timeS + bucketS / 2);
    // Nearest end first, so that the line between two buckets is short.
    const [near, far] = Math.abs(bottom - before) <= Math.abs(top - before) ? [bottom, top] : [top, bottom];
    if (open && held) brush.lineTo(middle, before);
    if (open) brush.lineTo(middle, near);
    else brush.moveTo(middle, near);
    if (far !== near) brush.lineTo(middle, far);
    open = true;
    before = far;
  }
}

/** Fills from the least to the greatest, as it holds from each time on. */
export function paintBand(area: Area, track: Track, y: (value: number) => number, colour: string): void {
  const { brush, x, toS } = area;
  const { t, low, high } = track;
  brush.beginPath();
  for (let at = first(track, area.fromS); at < t.length && (t[at] ?? 0) <= toS; at += 1) {
    const [least, greatest] = [low[at] ?? NaN, high[at] ?? NaN];
    if (Number.isNaN(least)) continue;
    const [left, right] = [x(t[at] ?? 0), x(Math.min(t[at + 1] ?? area.endS, toS))];
    brush.rect(left, y(greatest), right - left, y(least) - y(greatest));
  }
  brush.fillStyle = colour;
  brush.fill();
}
