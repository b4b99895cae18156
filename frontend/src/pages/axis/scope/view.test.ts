import { describe, expect, it } from "vitest";
import { moved, pairText, parsePair, stretchOf, zoomed, zoomOf } from "./view";

describe("a stretch of a capture", () => {
  it("stands in a link and comes back from it", () => {
    expect(parsePair(pairText([-0.25, 1.5]))).toEqual([-0.25, 1.5]);
    expect(pairText([-1e-7, 0.1234567])).toBe("0..0.123457");
    expect([parsePair("a..b"), parsePair(""), parsePair(undefined)]).toEqual([null, null, null]);
  });

  it("is the whole where a link names one that is elsewhere", () => {
    expect(zoomOf("5..6", [-1, 4])).toEqual([-1, 4]);
    expect(zoomOf("2..1", [-1, 4])).toEqual([-1, 4]);
    expect(zoomOf("0..1", [-1, 4])).toEqual([0, 1]);
  });

  it("zooms around a time and never leaves the whole", () => {
    expect(zoomed([-1, 4], [-1, 4], 0.5, 0)).toEqual([-0.5, 2]);
    expect(zoomed([0, 1], [-1, 4], 10, 0)).toBeNull();
    expect(moved([3, 4], [-1, 4], 0.5)).toEqual([3, 4]);
    expect(moved([0, 1], [-1, 4], -0.5)).toEqual([-0.5, 0.5]);
  });

  it("of the cursors goes before that in view", () => {
    expect(stretchOf([2, 1], [0, 5])).toEqual([1, 2]);
    expect(stretchOf(null, [0, 5])).toEqual([0, 5]);
    expect(stretchOf([1, 1], [0, 5])).toEqual([0, 5]);
  });
});
