/** Which point of a curve is meant, by the pointer or by keys. */

type Numbers = readonly (number | null)[];
type Place = (value: number, scale: "x" | "y") => number;

/** The point nearest to a place in px, over both axes or along x alone; null where there is none. */
export function nearest(
  x: Numbers,
  y: Numbers,
  place: Place,
  left: number,
  top: number,
  alongX: boolean,
): number | null {
  let [found, least]: [number | null, number] = [null, Infinity];
  x.forEach((at, n) => {
    const value = y[n] ?? null;
    if (at === null || value === null) return;
    const away = Math.hypot(place(at, "x") - left, alongX ? 0 : place(value, "y") - top);
    if (away < least) [found, least] = [n, away];
  });
  return found;
}

/** The next point that is one, from `from` by `step` on; where there is none, the same. */
export function next(x: Numbers, y: Numbers, from: number | null, step: 1 | -1): number | null {
  let at = from === null ? (step === 1 ? 0 : x.length - 1) : from + step;
  while (at >= 0 && at < x.length) {
    if (x[at] != null && y[at] != null) return at;
    at += step;
  }
  return from;
}
