/** How far a mark may be moved: up to its neighbours, and no further. All numbers are raw. */

export interface Edge {
  /** The last value that is allowed. */
  raw: number;
  /** What stands behind it, in words; null where it is the object's own limit. */
  other: string | null;
}

export interface Bounds {
  low: Edge | null;
  high: Edge | null;
}

export const FREE: Bounds = { low: null, high: null };

export interface Held {
  raw: number;
  /** What it stopped at; null where nothing was in the way. */
  by: Edge | null;
}

/** The value, or the last one before what is in the way. */
export function held(raw: number, { low, high }: Bounds): Held {
  if (high !== null && raw > high.raw) return { raw: high.raw, by: high };
  if (low !== null && raw < low.raw) return { raw: low.raw, by: low };
  return { raw, by: null };
}

/** No value at all is between the edges: the neighbours themselves are out of order. */
export const isShut = ({ low, high }: Bounds): boolean => low !== null && high !== null && low.raw > high.raw;

const tighter = (
  a: Edge | null,
  b: Edge | null,
  isTighter: (a: number, b: number) => boolean,
): Edge | null => (a === null ? b : b === null || !isTighter(b.raw, a.raw) ? a : b);

/** Both bounds at a time. */
export function within(a: Bounds, b: Bounds): Bounds {
  return {
    low: tighter(a.low, b.low, (one, other) => one > other),
    high: tighter(a.high, b.high, (one, other) => one < other),
  };
}

export interface Neighbour {
  raw: number | null;
  name: string;
  /** How far from it the mark must stay, in raw steps. */
  gap: number;
}

/** Between two neighbours; one that is not known, or not there, holds nothing. */
export function between(below: Neighbour | null, above: Neighbour | null): Bounds {
  return {
    low: below?.raw == null ? null : { raw: below.raw + below.gap, other: below.name },
    high: above?.raw == null ? null : { raw: above.raw - above.gap, other: above.name },
  };
}

/** What a key of a slider does to its value; null where the key is none of them. */
export function keyed(key: string, raw: number, page: number, { low, high }: Bounds): number | null {
  switch (key) {
    case "ArrowRight":
    case "ArrowUp":
      return raw + 1;
    case "ArrowLeft":
    case "ArrowDown":
      return raw - 1;
    case "PageUp":
      return raw + page;
    case "PageDown":
      return raw - page;
    case "Home":
      return low?.raw ?? raw;
    case "End":
      return high?.raw ?? raw;
    default:
      return null;
  }
}
