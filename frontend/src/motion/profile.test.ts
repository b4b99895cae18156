import { describe, expect, it } from "vitest";
import { type Profile, profileOf, shareAt } from "./profile";

const told = (profile: Profile | null): Profile => {
  if (profile === null) throw new Error("no profile");
  return profile;
};

const ramps = { speedDps: 4, accelerationDps2: 8, decelerationDps2: 4 };

describe("the way to an angle", () => {
  it("has two ramps and a steady part", () => {
    // Up 0.5 s and 1 degree, down 1 s and 2 degrees, 7 degrees at 4 degrees a second between them.
    expect(profileOf(10, ramps)).toEqual({ upS: 0.5, downS: 1, steadyS: 1.75, totalS: 3.25, peakDps: 4 });
    expect(profileOf(-10, ramps)).toEqual(profileOf(10, ramps));
  });

  it("does not come to its speed on a short way", () => {
    const short = profileOf(0.75, ramps);
    expect(short?.peakDps).toBeCloseTo(2, 9);
    expect(short?.steadyS).toBeCloseTo(0, 9);
    expect(short?.totalS).toBeCloseTo(0.75, 9);
  });

  it("is not told without speed or ramps", () => {
    expect(profileOf(10, { ...ramps, speedDps: 0 })).toBeNull();
    expect(profileOf(10, { ...ramps, accelerationDps2: 0 })).toBeNull();
    expect(profileOf(10, { ...ramps, decelerationDps2: NaN })).toBeNull();
  });

  it("goes on all the time, from its beginning to its end, as fast as it says", () => {
    const profile = told(profileOf(10, ramps));
    expect(shareAt(profile, -1)).toBe(0);
    expect(shareAt(profile, profile.totalS + 1)).toBe(1);
    let before = 0;
    for (let at = 0; at <= profile.totalS; at += 0.01) {
      const speed = (10 * (shareAt(profile, at) - before)) / 0.01;
      expect(speed).toBeGreaterThanOrEqual(0);
      expect(speed).toBeLessThanOrEqual(4.001);
      before = shareAt(profile, at);
    }
    expect(10 * shareAt(profile, 0.5)).toBeCloseTo(1, 9);
    expect(10 * shareAt(profile, 2.25)).toBeCloseTo(8, 9);
  });

  it("is over at once where there is no way", () => {
    const none = told(profileOf(0, ramps));
    expect(none.totalS).toBe(0);
    expect(shareAt(none, 0)).toBe(1);
  });
});
