/** What the page of the scope shows, as it stands in the URL: stretches in s, cursors, references. */
import type { Span } from "../../../api/scope";

export type Pair = readonly [number, number];

const PAIR = /^(-?\d+(?:\.\d+)?)\.\.(-?\d+(?:\.\d+)?)$/;

export function parsePair(text: string | undefined): Pair | null {
  const match = text === undefined ? null : PAIR.exec(text);
  return match ? [Number(match[1]), Number(match[2])] : null;
}

/** To a microsecond. */
export const pairText = ([a, b]: Pair): string => `${Number(a.toFixed(6))}..${Number(b.toFixed(6))}`;

/** The stretch of a link, where there is one within the whole. */
export function zoomOf(text: string | undefined, whole: Pair): Pair {
  const pair = parsePair(text);
  if (pair === null || pair[1] <= pair[0] || pair[1] < whole[0] || pair[0] > whole[1]) return whole;
  return pair;
}

const LEAST_S = 1e-4;

/** Closer in (below 1) or further out around a time; null where all is in view. */
export function zoomed(view: Pair, whole: Pair, factor: number, atS: number): Pair | null {
  const length = Math.max(LEAST_S, (view[1] - view[0]) * factor);
  const share = (atS - view[0]) / (view[1] - view[0]);
  return within([atS - share * length, atS + (1 - share) * length], whole);
}

export function moved(view: Pair, whole: Pair, share: number): Pair | null {
  const by = (view[1] - view[0]) * share;
  return within([view[0] + by, view[1] + by], whole);
}

export function within(view: Pair, whole: Pair): Pair | null {
  const length = view[1] - view[0];
  if (length >= (whole[1] - whole[0]) * 0.999) return null;
  const from = Math.min(Math.max(view[0], whole[0]), whole[1] - length);
  return [from, from + length];
}

export const listOf = (text: string | undefined): string[] =>
  (text ?? "").split(",").filter((one) => one !== "");

/** What a spectrum and an XY are made of: between the cursors where there are any, else what is in view. */
export function stretchOf(cursors: Pair | null, view: Pair): NonNullable<Span> {
  if (cursors === null || cursors[0] === cursors[1]) return [view[0], view[1]];
  return [Math.min(...cursors), Math.max(...cursors)];
}
