import { expect, it } from "vitest";
import { divide, fraction, fractionOf, toFixed, toNumber, wholeOf } from "./decimal";

it("reads decimals and exponents exactly", () => {
  expect(fraction("0,1")).toEqual({ num: 1n, den: 10n });
  expect(fraction("-12.50")).toEqual({ num: -1250n, den: 100n });
  expect(fraction("2e3")).toEqual({ num: 2000n, den: 1n });
  expect(fractionOf(1e-7)).toEqual({ num: 1n, den: 10000000n });
  expect(fraction("1,2,3")).toBeNull();
  expect(fraction("")).toBeNull();
});

it("rounds half away from zero and shows no negative zero", () => {
  expect(toFixed({ num: 25n, den: 10n }, 0)).toBe("3");
  expect(toFixed({ num: -25n, den: 10n }, 0)).toBe("-3");
  expect(toFixed({ num: -4n, den: 100n }, 1)).toBe("0.0");
  expect(toFixed({ num: 5n, den: 1000n }, 3)).toBe("0.005");
});

it("divides exactly and knows what is whole", () => {
  expect(wholeOf(divide(fractionOf(0.3), fractionOf(0.1)))).toBe(3n);
  expect(wholeOf(divide(fractionOf(0.35), fractionOf(0.1)))).toBeNull();
  expect(divide(fractionOf(1), fractionOf(-2))).toEqual({ num: -1n, den: 2n });
  expect(toNumber(fractionOf(-2.5))).toBe(-2.5);
});
