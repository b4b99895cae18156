import { describe, expect, it } from "vitest";
import {
  following,
  LEAST_NS,
  lengthOf,
  panned,
  placeOf,
  ticksOf,
  timeAt,
  windowOf,
  zoomed,
} from "./timelineView";

const S = 1e9;
const START = 1_700_000_000 * S;
const whole = { fromNs: START, toNs: START + 60 * S };
const half = { fromNs: START + 10 * S, toNs: START + 40 * S };

describe("the timeline", () => {
  it("finds the time at a place and the place of a time", () => {
    expect(placeOf(START + 25 * S, half, 300)).toBeCloseTo(150);
    expect(timeAt(150, half, 300)).toBe(START + 25 * S);
  });

  it("zooms about the pointer and never beyond the recording", () => {
    const near = zoomed(whole, whole, 0.5, START + 30 * S);
    expect(near).toEqual({ fromNs: START + 15 * S, toNs: START + 45 * S });
    expect(zoomed(near, whole, 4, START + 20 * S)).toEqual(whole);
    expect(zoomed(near, whole, 0.5, START + 15 * S).fromNs).toBe(START + 15 * S);
    expect(lengthOf(zoomed(near, whole, 1e-12, START + 30 * S))).toBeCloseTo(LEAST_NS, -3);
  });

  it("pans to the ends and keeps its length", () => {
    expect(panned(half, whole, -100 * S)).toEqual({ fromNs: START, toNs: START + 30 * S });
    expect(panned(half, whole, 100 * S)).toEqual({ fromNs: START + 30 * S, toNs: START + 60 * S });
  });

  it("goes along with a cursor that leaves it, and only then", () => {
    expect(following(half, whole, START + 39 * S)).toBe(half);
    expect(following(half, whole, START + 41 * S)).toEqual({ fromNs: START + 30 * S, toNs: START + 60 * S });
  });

  it("says that all is in view", () => {
    expect(windowOf(whole, whole)).toBeNull();
    expect(windowOf(half, whole)).toBe(half);
  });

  it("marks round times, none too near to the next", () => {
    const { stepS, at } = ticksOf(half, 600, 90);
    expect(stepS).toBe(5);
    expect(at.every((tNs) => tNs % (5 * S) === 0 && tNs >= half.fromNs && tNs <= half.toNs)).toBe(true);
    expect(at.length).toBeGreaterThan(5);
  });
});
