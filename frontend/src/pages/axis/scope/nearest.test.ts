import { describe, expect, it } from "vitest";
import { nearest, next } from "./nearest";

const X = [0, 1, null, 2, 3];
const Y = [0, 5, 1, null, 1];
const place = (value: number, scale: "x" | "y") => (scale === "x" ? value * 100 : 500 - value * 100);

describe("the point of a curve", () => {
  it("is the nearest along the axis, or over both", () => {
    expect(nearest(X, Y, place, 110, 490, true)).toBe(1);
    expect(nearest(X, Y, place, 110, 490, false)).toBe(0);
    expect(nearest(X, Y, place, 240, 400, true)).toBe(4);
  });

  it("is none where there are only gaps", () => {
    expect(nearest([null, 1], [1, null], place, 0, 0, true)).toBeNull();
    expect(next([null], [1], null, 1)).toBeNull();
  });

  it("goes on by keys over gaps, and stays at the ends", () => {
    expect([next(X, Y, null, 1), next(X, Y, null, -1)]).toEqual([0, 4]);
    expect([next(X, Y, 1, 1), next(X, Y, 4, -1)]).toEqual([4, 1]);
    expect([next(X, Y, 4, 1), next(X, Y, 0, -1)]).toEqual([4, 0]);
  });
});
