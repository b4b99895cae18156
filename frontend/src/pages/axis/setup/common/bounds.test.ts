import { describe, expect, it } from "vitest";
import { between, FREE, held, isShut, keyed, within } from "./bounds";

const below = { raw: 400, name: "minimum", gap: 1 };
const above = { raw: 560, name: "nominal", gap: 1 };

describe("bounds", () => {
  it("stops one step before a neighbour and says at which", () => {
    const bounds = between(below, above);
    expect(held(480, bounds)).toEqual({ raw: 480, by: null });
    expect(held(560, bounds)).toEqual({ raw: 559, by: { raw: 559, other: "nominal" } });
    expect(held(-5, bounds)).toEqual({ raw: 401, by: { raw: 401, other: "minimum" } });
  });

  it("may stand on a neighbour with no gap", () => {
    expect(held(560, between(null, { ...above, gap: 0 }))).toEqual({ raw: 560, by: null });
    expect(held(561, between(null, { ...above, gap: 0 })).raw).toBe(560);
  });

  it("is not held by what is not known", () => {
    expect(between({ ...below, raw: null }, null)).toEqual(FREE);
    expect(held(99_999, FREE)).toEqual({ raw: 99_999, by: null });
  });

  it("knows that neighbours out of order leave no room", () => {
    expect(isShut(between(above, below))).toBe(true);
    expect(isShut(between(below, above))).toBe(false);
    expect(isShut(FREE)).toBe(false);
  });

  it("takes the tighter of two bounds on each side", () => {
    const own = { low: { raw: 0, other: null }, high: { raw: 500, other: null } };
    expect(within(own, between(below, above))).toEqual({
      low: { raw: 401, other: "minimum" },
      high: { raw: 500, other: null },
    });
    expect(within(FREE, own)).toEqual(own);
    expect(within(own, FREE)).toEqual(own);
  });

  it("moves by keys: one step, a page, to the ends", () => {
    const bounds = between(below, above);
    const keys = ["ArrowUp", "ArrowRight", "ArrowLeft", "PageUp", "PageDown", "Home", "End", "x"];
    expect(keys.map((key) => keyed(key, 420, 10, bounds))).toEqual([421, 421, 419, 430, 410, 401, 559, null]);
    expect(keyed("Home", 420, 10, FREE)).toBe(420);
  });
});
