import { describe, expect, it } from "vitest";
import { scaleFor, shareOf, ticksOf, valueAt } from "./scale";

const SCALE = { low: -40, high: 160 };

describe("scale", () => {
  it("stands values at their share, and what is outside at the end", () => {
    expect([-40, 60, 160, 500, -90].map((one) => shareOf(SCALE, one))).toEqual([0, 0.5, 1, 1, 0]);
  });

  it("gives back the value of a place, on whole steps and never outside", () => {
    expect(valueAt(SCALE, 0.5, 1)).toBe(60);
    expect(valueAt(SCALE, 0.4527, 1)).toBe(51);
    expect(valueAt(SCALE, 0.4527, 5)).toBe(50);
    expect([-1, 2].map((one) => valueAt(SCALE, one, 1))).toEqual([-40, 160]);
    for (const value of [-40, -7, 0, 33, 160]) expect(valueAt(SCALE, shareOf(SCALE, value), 1)).toBe(value);
  });

  it("has ticks at whole steps", () => {
    expect(ticksOf(SCALE, 50)).toEqual([0, 50, 100, 150]);
    expect(ticksOf({ low: -45, high: 45 }, 20)).toEqual([-40, -20, 0, 20, 40]);
  });

  it("widens by whole steps for values that are outside, and for no others", () => {
    expect(scaleFor(SCALE, [12, 150], 20)).toEqual(SCALE);
    expect(scaleFor(SCALE, [-41, 161], 20)).toEqual({ low: -60, high: 180 });
  });
});
