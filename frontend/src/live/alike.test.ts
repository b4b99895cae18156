import { describe, expect, it } from "vitest";
import { alike, Kept } from "./alike";

describe("what would be shown alike", () => {
  it("is equal, or made of equal parts", () => {
    expect(alike(NaN, NaN)).toBe(true);
    expect(alike({ unit: "°", marks: ["a", "b"] }, { unit: "°", marks: ["a", "b"] })).toBe(true);
    expect(alike({ unit: "°", marks: ["a", "b"] }, { unit: "°", marks: ["a"] })).toBe(false);
    expect(alike({ one: undefined }, { other: undefined })).toBe(false);
    expect(alike([], {})).toBe(false);
    expect(alike(null, {})).toBe(false);
    expect(alike("1", 1)).toBe(false);
  });

  it("is told by the parts of records and lists only, and not down to the last", () => {
    const day = new Date(0);
    expect(alike({ day }, { day })).toBe(true);
    expect(alike({ day }, { day: new Date(0) })).toBe(false);
    expect(alike({ a: { b: { c: 1 } } }, { a: { b: { c: 1 } } })).toBe(true);
    expect(alike({ a: { b: { c: {} } } }, { a: { b: { c: {} } } })).toBe(false);
  });

  it("stays the very same until another one comes", () => {
    const kept = new Kept<{ angle: string }>();
    const first = { angle: "1.00°" };
    expect(kept.shows(first, alike)).toBe(false);
    expect(kept.take(first, alike)).toBe(first);
    expect(kept.take({ angle: "1.00°" }, alike)).toBe(first);
    expect(kept.shows({ angle: "1.01°" }, alike)).toBe(false);
    expect(kept.take({ angle: "1.01°" }, alike)).toEqual({ angle: "1.01°" });
  });
});
