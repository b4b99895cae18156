/** Where what lies on the timeline. Times in ns, places in px; a stretch never leaves the recording. */
import type { Stretch } from "./looking";

/** So much at least is in view: a few frames of a busy bus. */
export const LEAST_NS = 1e6;

export const lengthOf = ({ fromNs, toNs }: Stretch): number => toNs - fromNs;

export function placeOf(tNs: number, view: Stretch, width: number): number {
  return ((tNs - view.fromNs) / lengthOf(view)) * width;
}

export function timeAt(x: number, view: Stretch, width: number): number {
  return view.fromNs + (x / width) * lengthOf(view);
}

export const clamp = (at: number, { fromNs, toNs }: Stretch): number => Math.min(toNs, Math.max(fromNs, at));

/** `factor` below 1 shows less: what is at `atNs` stays where it is. */
export function zoomed(view: Stretch, whole: Stretch, factor: number, atNs: number): Stretch {
  const length = Math.min(lengthOf(whole), Math.max(LEAST_NS, lengthOf(view) * factor));
  const share = (atNs - view.fromNs) / lengthOf(view);
  return within({ fromNs: atNs - share * length, toNs: atNs + (1 - share) * length }, whole);
}

export function panned(view: Stretch, whole: Stretch, byNs: number): Stretch {
  return within({ fromNs: view.fromNs + byNs, toNs: view.toNs + byNs }, whole);
}

/** Moves the stretch along where the cursor is about to leave it. */
export function following(view: Stretch, whole: Stretch, cursorNs: number): Stretch {
  if (cursorNs >= view.fromNs && cursorNs <= view.toNs) return view;
  const length = lengthOf(view);
  return within({ fromNs: cursorNs - 0.1 * length, toNs: cursorNs + 0.9 * length }, whole);
}

function within({ fromNs, toNs }: Stretch, whole: Stretch): Stretch {
  const length = Math.min(toNs - fromNs, lengthOf(whole));
  const from = Math.min(Math.max(fromNs, whole.fromNs), whole.toNs - length);
  return { fromNs: from, toNs: from + length };
}

/** Null where all is in view. */
export function windowOf(view: Stretch, whole: Stretch): Stretch | null {
  return lengthOf(view) >= lengthOf(whole) * 0.999 ? null : view;
}

const STEPS_S = [
  1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600,
  900, 1800, 3600, 7200, 10_800, 21_600, 43_200, 86_400,
];

export interface Ticks {
  stepS: number;
  at: number[];
}

/** Round times of the day in view, at least `apartPx` from each other. */
export function ticksOf(view: Stretch, width: number, apartPx: number): Ticks {
  const wantedS = ((lengthOf(view) / 1e9) * apartPx) / width;
  const stepS = STEPS_S.find((one) => one >= wantedS) ?? 86_400;
  const stepNs = stepS * 1e9;
  // Round by the clock of the person: whole hours, not whole hours of Greenwich.
  const shiftNs = -new Date(view.fromNs / 1e6).getTimezoneOffset() * 60e9;
  const first = Math.ceil((view.fromNs + shiftNs) / stepNs) * stepNs - shiftNs;
  const at: number[] = [];
  for (let tNs = first; tNs <= view.toNs && at.length < 200; tNs += stepNs) at.push(tNs);
  return { stepS, at };
}
