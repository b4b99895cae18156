/**
 * Signals over time, as they are drawn and read. Times are in seconds since the beginning of the recording; a NaN is a
 * break: from there nothing is known. Between two values nothing is known either, so a value is read as the last one seen.
 */

/** A signal as the server tells it. */
export interface SeriesData {
  exact: boolean;
  bucket_s: number;
  t_s: readonly number[];
  low: readonly (number | null)[];
  high: readonly (number | null)[];
}

export interface Track {
  /** Every value, with `low` the same as `high`; else least and greatest of each bucket of `bucketS`. */
  exact: boolean;
  bucketS: number;
  t: Float64Array;
  low: Float64Array;
  high: Float64Array;
}

/** Least and greatest; both the same where it is one value. */
export interface Span {
  low: number;
  high: number;
}

const numbers = (values: readonly (number | null)[]) => Float64Array.from(values, (one) => one ?? NaN);

export const trackOf = ({ exact, bucket_s, t_s, low, high }: SeriesData): Track => ({
  exact,
  bucketS: bucket_s,
  t: Float64Array.from(t_s),
  low: numbers(low),
  high: numbers(high),
});

/** Index of the last point at or before `atS`; -1 before the first. */
export function indexAt(times: Float64Array, atS: number): number {
  let [low, high] = [0, times.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((times[middle] ?? Infinity) <= atS) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/** What was last seen at or before `atS`; null where nothing is known. A bucket is all that is known within it. */
export function spanAt({ t, low, high }: Track, atS: number): Span | null {
  const at = indexAt(t, atS);
  const [least, greatest] = [low[at] ?? NaN, high[at] ?? NaN];
  return Number.isNaN(least) ? null : { low: least, high: greatest };
}

/** Least and greatest of a stretch, what held when it began among them. */
export function spanIn(track: Track, fromS: number, toS: number): Span | null {
  let [low, high] = [Infinity, -Infinity];
  const last = indexAt(track.t, toS);
  for (let at = Math.max(0, indexAt(track.t, fromS)); at <= last; at += 1) {
    const [least, greatest] = [track.low[at] ?? NaN, track.high[at] ?? NaN];
    if (least < low) low = least;
    if (greatest > high) high = greatest;
  }
  return low > high ? null : { low, high };
}

/** Least and greatest of several; null where there is none. */
export function joined(spans: readonly (Span | null)[]): Span | null {
  const known = spans.filter((one) => one !== null);
  if (known.length === 0) return null;
  return {
    low: Math.min(...known.map((one) => one.low)),
    high: Math.max(...known.map((one) => one.high)),
  };
}

/**
 * How far signals disagree: least and greatest of all that is known of them, as it holds from each time on. A break where
 * fewer than two are known.
 */
export function disagreement(tracks: readonly Track[], fromS: number, toS: number): Track {
  const at = tracks.map(({ t }) => Math.max(0, indexAt(t, fromS)));
  const [times, lows, highs]: [number[], number[], number[]] = [[], [], []];
  for (;;) {
    let next = Infinity;
    tracks.forEach(({ t }, n) => (next = Math.min(next, t[at[n] ?? 0] ?? Infinity)));
    if (next > toS || next === Infinity) break;
    tracks.forEach(({ t }, n) => {
      if (t[at[n] ?? 0] === next) at[n] = (at[n] ?? 0) + 1;
    });
    const spans = tracks.map(({ low, high }, n) => ({
      low: low[(at[n] ?? 0) - 1] ?? NaN,
      high: high[(at[n] ?? 0) - 1] ?? NaN,
    }));
    const known = spans.filter(({ low }) => !Number.isNaN(low));
    const both = known.length > 1 ? joined(known) : null;
    times.push(next);
    lows.push(both?.low ?? NaN);
    highs.push(both?.high ?? NaN);
  }
  return {
    exact: true,
    bucketS: 0,
    t: Float64Array.from(times),
    low: Float64Array.from(lows),
    high: Float64Array.from(highs),
  };
}

/** So many times the usual distance between two values, and so long at least, is a hole. */
const HOLE = 8;
const LEAST_HOLE_S = 0.25;

/**
 * What comes all the time and then does not is known no longer: a break after the last value before each hole, and before
 * the end where that is one.
 */
export function withHoles(track: Track, endS: number): Track {
  const { t, low, high, bucketS } = track;
  const holeS = Math.max(LEAST_HOLE_S, HOLE * (track.exact ? usualStep(t) : bucketS));
  const stepS = holeS / HOLE;
  const at = Array.from(t.keys()).filter(
    (n) => n > 0 && (t[n] ?? 0) - (t[n - 1] ?? 0) > holeS && !Number.isNaN(low[n - 1] ?? NaN),
  );
  const lastS = t.at(-1) ?? endS;
  const ends = endS - lastS > holeS && t.length > 1 && !Number.isNaN(low.at(-1) ?? NaN);
  if (at.length === 0 && !ends) return track;
  const holes = new Set(at);
  const [times, lows, highs]: [number[], number[], number[]] = [[], [], []];
  t.forEach((timeS, n) => {
    if (holes.has(n)) {
      times.push((t[n - 1] ?? 0) + stepS);
      lows.push(NaN);
      highs.push(NaN);
    }
    times.push(timeS);
    lows.push(low[n] ?? NaN);
    highs.push(high[n] ?? NaN);
  });
  if (ends) {
    times.push(lastS + stepS);
    lows.push(NaN);
    highs.push(NaN);
  }
  return {
    ...track,
    t: Float64Array.from(times),
    low: Float64Array.from(lows),
    high: Float64Array.from(highs),
  };
}

/** The usual distance of two values that follow each other, s. */
function usualStep(times: Float64Array): number {
  const steps = times.slice(1).map((timeS, n) => timeS - (times[n] ?? 0));
  return steps.sort()[steps.length >> 1] ?? 0;
}
