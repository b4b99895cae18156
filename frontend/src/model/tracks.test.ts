import { describe, expect, it } from "vitest";
import { disagreement, indexAt, joined, spanAt, spanIn, trackOf, withHoles } from "./tracks";

const track = (t_s: number[], low: (number | null)[], high = low, exact = true) =>
  trackOf({ exact, bucket_s: exact ? 0 : 1, t_s, low, high });

describe("a signal over time", () => {
  const seen = track([1, 2, 3, 5], [10, 30, null, 20]);

  it("is read as the last value that was seen, and as nothing after a break", () => {
    expect([0.9, 1, 1.99, 2, 3, 4.9, 5, 99].map((at) => spanAt(seen, at)?.low ?? null)).toEqual([
      null,
      10,
      10,
      30,
      null,
      null,
      20,
      20,
    ]);
    expect(indexAt(seen.t, 0)).toBe(-1);
  });

  it("spans in a stretch what held when that began", () => {
    expect(spanIn(seen, 1.5, 1.8)).toEqual({ low: 10, high: 10 });
    expect(spanIn(seen, 1.5, 2.5)).toEqual({ low: 10, high: 30 });
    expect(spanIn(seen, 3.5, 4)).toBeNull();
    expect(spanIn(seen, 0, 0.5)).toBeNull();
  });

  it("is known no longer where it came all the time and then did not", () => {
    const times = [0, 0.1, 0.2, 0.3, 9, 9.1];
    const holed = withHoles(track(times, [1, 2, 3, 4, 5, 6]), 9.2);
    expect(spanAt(holed, 0.35)?.low).toBe(4);
    expect(spanAt(holed, 5)).toBeNull();
    expect(spanAt(holed, 9)?.low).toBe(5);
    expect(holed.t.length).toBe(times.length + 1);
    expect(spanAt(withHoles(track(times, times), 20), 19)).toBeNull();
    expect(spanAt(holed, 9.2)?.low).toBe(6);
  });

  it("tells of a bucket all that it holds", () => {
    const coarse = track([0, 1], [1, 2], [4, 8], false);
    expect(spanAt(coarse, 1.7)).toEqual({ low: 2, high: 8 });
    expect(spanIn(coarse, 0.2, 0.3)).toEqual({ low: 1, high: 4 });
  });
});

describe("disagreement", () => {
  it("is from the least to the greatest of what holds at a time", () => {
    const one = track([0, 2, 4], [1, 5, null]);
    const other = track([1, 3], [2, 9]);
    const found = disagreement([one, other], -Infinity, Infinity);
    expect([...found.t]).toEqual([0, 1, 2, 3, 4]);
    expect([...found.low]).toEqual([NaN, 1, 2, 5, NaN]);
    expect([...found.high]).toEqual([NaN, 2, 5, 9, NaN]);
  });

  it("begins with what held before the stretch, and ends with it", () => {
    const one = track([0, 2, 4], [1, 5, 7]);
    const found = disagreement([one, track([1], [2])], 3, 3.5);
    expect([...found.t]).toEqual([1, 2]);
    expect([...found.high]).toEqual([2, 5]);
  });

  it("of spans is their hull", () => {
    expect(joined([null, { low: 1, high: 2 }, { low: -1, high: 0 }])).toEqual({ low: -1, high: 2 });
    expect(joined([null])).toBeNull();
  });
});
