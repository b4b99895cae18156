import { describe, expect, it } from "vitest";
import { durationS, reach, USUAL } from "./settings";

describe("test signal", () => {
  it("takes as long as its fades, cycles and rests", () => {
    expect(durationS(USUAL.sine)).toBe(11);
    expect(durationS(USUAL.step)).toBe(3);
    expect(durationS(USUAL.ramp)).toBe(6.5);
  });

  it("reaches to both sides as a sine, to one as a step", () => {
    expect(reach(USUAL.sine, 80)).toEqual([79, 81]);
    expect(reach(USUAL.step, 80)).toEqual([79.5, 80]);
    expect(reach({ ...USUAL.ramp, amplitude_deg: 3 }, 80)).toEqual([80, 83]);
  });
});
