import { describe, expect, it } from "vitest";
import { speedBeside, SPEEDS } from "./transport";

describe("the speeds of a replay", () => {
  it("go from a hundredth to fifty times, step by step and no farther", () => {
    const faster: number[] = [SPEEDS[0]];
    for (;;) {
      const next = speedBeside(faster.at(-1) ?? 0, true);
      if (next === faster.at(-1)) break;
      faster.push(next);
    }
    expect(faster).toEqual([...SPEEDS]);
    expect(speedBeside(0.01, false)).toBe(0.01);
    expect(speedBeside(50, true)).toBe(50);
    expect(speedBeside(3, true)).toBe(5);
    expect(speedBeside(3, false)).toBe(2);
  });
});
