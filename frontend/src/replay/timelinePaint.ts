/** Draws the timeline: the whole recording as a strip above, the stretch in view below it, with its ruler. */
import type { Loop, Timeline, TimelineGap, TimelineMark } from "../api/replay";
import type { Stretch } from "./looking";
import type { Marked } from "./marked";
import { placeOf, type Ticks } from "./timelineView";

export const STRIP_PX = 12;
const SPACE_PX = 4;
export const LANE_TOP_PX = STRIP_PX + SPACE_PX;
export const RULER_PX = 15;
const MARK_PX = 5;
const BAR_PX = 3;
const FLAG_PX = 9;
/** So wide at least, that the shortest gap is seen. */
const LEAST_GAP_PX = 2;

export interface Colours {
  line: string;
  ground: string;
  text: string;
  dim: string;
  load: string[];
  info: string;
  warning: string;
  error: string;
  violet: string;
  accent: string;
  hatch: string;
}

export function coloursOf(element: HTMLElement): Colours {
  const style = getComputedStyle(element);
  const colour = (name: string) => style.getPropertyValue(name).trim();
  return {
    line: colour("--hs-line"),
    ground: colour("--hs-panel-2"),
    text: colour("--hs-text"),
    dim: colour("--hs-dim"),
    load: [colour("--hs-accent"), colour("--hs-ok"), colour("--hs-warn"), colour("--hs-violet")],
    info: colour("--hs-dim"),
    warning: colour("--hs-warn"),
    error: colour("--hs-error"),
    violet: colour("--hs-violet"),
    accent: colour("--hs-accent"),
    hatch: colour("--hs-dim"),
  };
}

type Brush = CanvasRenderingContext2D;

export interface Picture {
  width: number;
  height: number;
  view: Stretch;
  whole: Stretch;
  /** Of the stretch in view, and of the whole; null until the index knows them. */
  near: Timeline | null;
  far: Timeline | null;
  /** What people marked; it is known without an index. */
  marked: readonly Marked[];
  ticks: Ticks;
  label: (tNs: number, stepS: number) => string;
  colours: Colours;
}

/** All that stands still. */
export function paintGround(brush: Brush, picture: Picture): void {
  const { width, height, view, whole, near, far, marked, colours } = picture;
  const laneHeight = height - LANE_TOP_PX - RULER_PX;
  brush.clearRect(0, 0, width, height);
  brush.fillStyle = colours.ground;
  brush.fillRect(0, 0, width, STRIP_PX);
  brush.fillRect(0, LANE_TOP_PX, width, laneHeight);
  if (far) {
    loads(brush, far, whole, { top: 0, height: STRIP_PX, width }, colours);
    for (const gap of far.gaps) gapAt(brush, gap, whole, { top: 0, height: STRIP_PX, width }, colours, false);
    for (const mark of far.marks) {
      if (mark.severity === "info") continue;
      brush.fillStyle = colours[mark.severity];
      brush.fillRect(placeOf(mark.t_ns, whole, width) - 0.5, 1, 1.5, STRIP_PX - 2);
    }
  }
  outline(brush, view, whole, width, colours);
  ruler(brush, picture, laneHeight);
  const lane = { top: LANE_TOP_PX, height: laneHeight, width };
  const drawn = near ?? far;
  if (drawn) content(brush, drawn, view, lane, colours);
  for (const one of marked) {
    brush.fillStyle = colours.accent;
    brush.fillRect(placeOf(one.atNs, whole, width) - 1, STRIP_PX / 2, 2, STRIP_PX / 2);
    markedAt(brush, one, view, lane, colours);
  }
}

function content(brush: Brush, drawn: Timeline, view: Stretch, lane: Lane, colours: Colours): void {
  loads(brush, drawn, view, lane, colours);
  for (const gap of drawn.gaps) gapAt(brush, gap, view, lane, colours, true);
  // The gravest last, on top of the others.
  for (const severity of ["info", "warning", "error"] as const)
    for (const mark of drawn.marks)
      if (mark.severity === severity) markAt(brush, mark, placeOf(mark.t_ns, view, lane.width), colours);
}

interface Lane {
  top: number;
  height: number;
  width: number;
}

/** A row for each bus: how much of its bit rate was used. */
function loads(brush: Brush, timeline: Timeline, view: Stretch, lane: Lane, colours: Colours): void {
  const rows = Math.max(1, timeline.load.length);
  const rowHeight = lane.height / rows;
  const bucketNs = timeline.bucket_ns;
  timeline.load.forEach((load, row) => {
    const bottom = lane.top + (row + 1) * rowHeight;
    brush.fillStyle = colours.load[row % colours.load.length] ?? colours.dim;
    brush.globalAlpha = 0.42;
    const most = Math.max(1, ...load.frames);
    load.frames.forEach((frames, at) => {
      if (frames === 0) return;
      // Where the bit rate is not known the busiest moment is half of the row.
      const share = load.share[at] ?? frames / most / 2;
      const left = placeOf(timeline.from_ns + at * bucketNs, view, lane.width);
      const right = placeOf(timeline.from_ns + (at + 1) * bucketNs, view, lane.width);
      if (right < 0 || left > lane.width) return;
      const tall = Math.max(1, Math.min(1, share) * (rowHeight - 1));
      brush.fillRect(left, bottom - tall, Math.max(1, right - left), tall);
    });
    brush.globalAlpha = 1;
  });
}

/** What is missing is drawn as what it is: silence hatched, losses red, a step of the clock as a seam, a restart dashed. */
function gapAt(
  brush: Brush,
  gap: TimelineGap,
  view: Stretch,
  lane: Lane,
  colours: Colours,
  named: boolean,
): void {
  const from = placeOf(gap.from_ns, view, lane.width);
  const to = placeOf(gap.to_ns, view, lane.width);
  if (to < -1 || from > lane.width + 1) return;
  const left = Math.max(0, from);
  const wide = Math.max(LEAST_GAP_PX, Math.min(lane.width, to) - left);
  const kind = gap.kind.toLowerCase();
  brush.save();
  brush.beginPath();
  brush.rect(left, lane.top, wide, lane.height);
  brush.clip();
  if (kind === "silence" || kind === "bus_lost") {
    brush.fillStyle = colours.ground;
    brush.fillRect(left, lane.top, wide, lane.height);
    hatch(brush, left, wide, lane, kind === "silence" ? colours.hatch : colours.error);
  } else if (kind === "loss" || kind === "damage") {
    brush.fillStyle = colours.error;
    brush.globalAlpha = kind === "loss" ? 0.75 : 0.4;
    brush.fillRect(left, lane.top, wide, lane.height);
  } else seam(brush, left, lane, kind === "restart" ? colours.warning : colours.violet);
  brush.restore();
  const { count, frames } = gap.details;
  const lost = typeof count === "number" ? count : typeof frames === "number" ? frames : null;
  if (!named || kind !== "loss" || lost === null) return;
  brush.fillStyle = colours.error;
  brush.font = "600 10px Inter Variable, system-ui, sans-serif";
  brush.textAlign = left > lane.width - 40 ? "right" : "left";
  brush.fillText(
    `−${String(lost)}`,
    left + (left > lane.width - 40 ? -3 : wide + 3),
    lane.top + lane.height - 3,
  );
}

function hatch(brush: Brush, left: number, wide: number, lane: Lane, colour: string): void {
  brush.strokeStyle = colour;
  brush.lineWidth = 1;
  brush.globalAlpha = 0.7;
  brush.beginPath();
  const begin = Math.floor(left / 6) * 6 - lane.height;
  for (let x = begin; x < left + wide; x += 6) {
    brush.moveTo(x, lane.top + lane.height);
    brush.lineTo(x + lane.height, lane.top);
  }
  brush.stroke();
}

function seam(brush: Brush, left: number, lane: Lane, colour: string): void {
  brush.strokeStyle = colour;
  brush.lineWidth = LEAST_GAP_PX;
  brush.setLineDash([3, 2]);
  brush.beginPath();
  brush.moveTo(left + 1, lane.top);
  brush.lineTo(left + 1, lane.top + lane.height);
  brush.stroke();
}

/** A mark of its own shape for each severity: a dot, a triangle, a diamond. */
function markAt(brush: Brush, { severity }: TimelineMark, x: number, colours: Colours): void {
  const top = LANE_TOP_PX + 2;
  const half = severity === "info" ? MARK_PX - 2.5 : MARK_PX;
  brush.fillStyle = colours[severity];
  brush.strokeStyle = colours.ground;
  brush.lineWidth = 1;
  brush.beginPath();
  if (severity === "info") brush.arc(x, top + half, half, 0, Math.PI * 2);
  else if (severity === "warning") {
    brush.moveTo(x, top);
    brush.lineTo(x + half, top + 2 * half);
    brush.lineTo(x - half, top + 2 * half);
  } else {
    brush.moveTo(x, top);
    brush.lineTo(x + half, top + half);
    brush.lineTo(x, top + 2 * half);
    brush.lineTo(x - half, top + half);
  }
  brush.closePath();
  brush.fill();
  brush.stroke();
}

/** A stretch that somebody marked is a bar at the bottom of the lane, its moment a flag on it. */
function markedAt(
  brush: Brush,
  { fromNs, toNs, atNs, kind }: Marked,
  view: Stretch,
  lane: Lane,
  colours: Colours,
) {
  const bottom = lane.top + lane.height;
  const [from, to] = [placeOf(fromNs, view, lane.width), placeOf(toNs, view, lane.width)];
  const [left, right] = [Math.max(0, from), Math.min(lane.width, to)];
  brush.fillStyle = colours.accent;
  if (right > left) {
    brush.globalAlpha = kind === "incident" ? 0.85 : 0.5;
    brush.fillRect(left, bottom - BAR_PX, right - left, BAR_PX);
    brush.globalAlpha = 1;
  }
  const x = placeOf(atNs, view, lane.width);
  if (x < 0 || x > lane.width) return;
  const pole = kind === "incident" ? FLAG_PX + 5 : FLAG_PX;
  brush.fillRect(x - 0.75, bottom - pole - 2, 1.5, pole + 2);
  brush.beginPath();
  brush.moveTo(x, bottom - pole - 2);
  brush.lineTo(x + FLAG_PX - 1, bottom - pole + FLAG_PX / 2 - 3.5);
  brush.lineTo(x, bottom - pole + FLAG_PX - 5);
  brush.closePath();
  brush.fill();
}

/** The stretch in view, in the strip of the whole. */
function outline(brush: Brush, view: Stretch, whole: Stretch, width: number, colours: Colours): void {
  const left = placeOf(view.fromNs, whole, width);
  const right = placeOf(view.toNs, whole, width);
  if (right - left > width - 1) return;
  brush.fillStyle = colours.violet;
  brush.globalAlpha = 0.25;
  brush.fillRect(left, 0, Math.max(3, right - left), STRIP_PX);
  brush.globalAlpha = 1;
  brush.strokeStyle = colours.violet;
  brush.lineWidth = 1.5;
  brush.strokeRect(left + 0.75, 0.75, Math.max(3, right - left) - 1.5, STRIP_PX - 1.5);
}

function ruler(
  brush: Brush,
  { view, width, height, ticks, label, colours }: Picture,
  laneHeight: number,
): void {
  const bottom = LANE_TOP_PX + laneHeight;
  brush.font = "10.5px Inter Variable, system-ui, sans-serif";
  brush.textAlign = "center";
  for (const tNs of ticks.at) {
    const x = placeOf(tNs, view, width);
    brush.fillStyle = colours.line;
    brush.fillRect(x, LANE_TOP_PX, 1, laneHeight + 3);
    if (x < 24 || x > width - 24) continue;
    brush.fillStyle = colours.dim;
    brush.fillText(label(tNs, ticks.stepS), x, height - 3);
  }
  brush.fillStyle = colours.line;
  brush.fillRect(0, bottom, width, 1);
}

export interface Moving {
  cursorNs: number;
  loop: Loop | null;
  /** What is being selected. */
  selecting: Stretch | null;
  hoverNs: number | null;
}

/** What moves, in a layer of its own. */
export function paintMoving(
  brush: Brush,
  picture: Omit<Picture, "near" | "far" | "marked" | "ticks" | "label">,
  at: Moving,
): void {
  const { width, height, view, whole, colours } = picture;
  const bottom = height - RULER_PX;
  brush.clearRect(0, 0, width, height);
  const loop = at.selecting ?? (at.loop && { fromNs: at.loop.from_ns, toNs: at.loop.to_ns });
  if (loop) {
    const [left, right] = [placeOf(loop.fromNs, view, width), placeOf(loop.toNs, view, width)];
    brush.fillStyle = colours.violet;
    brush.globalAlpha = 0.22;
    brush.fillRect(left, LANE_TOP_PX, right - left, bottom - LANE_TOP_PX);
    brush.globalAlpha = 1;
    brush.fillRect(left, LANE_TOP_PX, 2, bottom - LANE_TOP_PX);
    brush.fillRect(right - 2, LANE_TOP_PX, 2, bottom - LANE_TOP_PX);
  }
  if (at.hoverNs !== null) line(brush, placeOf(at.hoverNs, view, width), bottom, colours.dim, 1);
  brush.fillStyle = colours.text;
  brush.fillRect(placeOf(at.cursorNs, whole, width) - 0.75, 0, 1.5, STRIP_PX);
  const x = placeOf(at.cursorNs, view, width);
  line(brush, x, bottom, colours.text, 2);
  brush.fillStyle = colours.text;
  brush.beginPath();
  brush.moveTo(x - 6, bottom + 7);
  brush.lineTo(x + 6, bottom + 7);
  brush.lineTo(x, bottom - 1);
  brush.closePath();
  brush.fill();
}

function line(brush: Brush, x: number, bottom: number, colour: string, wide: number): void {
  brush.fillStyle = colour;
  brush.fillRect(x - wide / 2, LANE_TOP_PX, wide, bottom - LANE_TOP_PX);
}
