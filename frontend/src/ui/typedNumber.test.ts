import { describe, expect, it } from "vitest";
import { typedNumber } from "./typedNumber";

describe("a typed number", () => {
  it.each([
    [90, 90],
    ["90.00", 90],
    ["5.", 5],
    ["-0.50", -0.5],
    ["", null],
    ["-", null],
    [" ", null],
  ])("%j is %j", (value, wanted) => {
    let found: number | null = null;
    typedNumber(value, (number) => (found = number));
    expect(found).toBe(wanted);
  });
});
