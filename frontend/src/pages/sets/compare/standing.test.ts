import { expect, it } from "vitest";
import { Against } from "./marks";
import { Standing, standingOf } from "./standing";

const beside = (...broken: number[]) => standingOf(broken, 3, Against.Reference);
const among = (...broken: number[]) => standingOf(broken, 3, Against.Majority);

it("holds what is broken against the reference", () => {
  expect(beside(1)).toBe(Standing.New);
  expect(beside(1, 2)).toBe(Standing.New);
  expect(beside(0, 2)).toBe(Standing.Standing);
  expect(beside(0)).toBe(Standing.Mended);
});

it("knows no reference among equals", () => {
  expect(among(0)).toBe(Standing.Some);
  expect(among(0, 1, 2)).toBe(Standing.All);
});
