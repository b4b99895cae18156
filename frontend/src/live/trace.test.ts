import { describe, expect, it } from "vitest";
import { KEPT_S, Trace } from "./trace";

const at = (positionDeg: number | null) => ({ positionDeg, demandDeg: null, velocityDps: 1, currentPct: 2 });

describe("trace of an axis", () => {
  it("breaks the line where messages were missing, and takes no time twice", () => {
    const trace = new Trace();
    for (const time of [10, 10.5, 10.5, 20]) trace.push(time, at(80));
    const { times, positions, velocities } = trace.columns(60);
    expect(times).toEqual([10, 10.5, 10.501, 20]);
    expect(positions).toEqual([80, 80, null, 80]);
    expect(velocities).toEqual([1, 1, null, 1]);
  });

  it("gives the span that is asked for, up to a chosen end", () => {
    const trace = new Trace();
    for (let time = 0; time <= 100; time += 0.5) trace.push(time, at(time));
    expect(trace.columns(10).times[0]).toBe(90);
    expect(trace.columns(10).times.at(-1)).toBe(100);
    const earlier = trace.columns(10, 50);
    expect([earlier.times[0], earlier.times.at(-1)]).toEqual([40, 50]);
    expect(earlier.currents.length).toBe(earlier.times.length);
  });

  it("stays bounded", () => {
    const trace = new Trace();
    for (let time = 0; time < 2000; time += 0.5) trace.push(time, at(0));
    const { times } = trace.columns(10_000);
    expect(times.length).toBeLessThan((KEPT_S + 30) * 2);
    expect(times.at(-1)).toBe(1999.5);
  });
});
