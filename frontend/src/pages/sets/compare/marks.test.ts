import { expect, it } from "vitest";
import type { CellDoc } from "../../../api/compare";
import { Against, Mark, marksOf } from "./marks";

const value = (raw: number | string): CellDoc => ({ state: "value", raw, shown: String(raw) }) as CellDoc;
const unread = { state: "unread", raw: null, shown: null } as unknown as CellDoc;
const { Reference, Same, Different, Apart } = Mark;

it("holds all columns against the first", () => {
  expect(marksOf([value(1), value(1), value(2), unread], Against.Reference)).toEqual([
    Reference,
    Same,
    Different,
    Apart,
  ]);
  expect(marksOf([unread, value(1)], Against.Reference)).toEqual([Reference, Apart]);
});

it("marks the blade that differs where two agree, and all where none do", () => {
  expect(marksOf([value(5), value(6), value(5)], Against.Majority)).toEqual([Same, Different, Same]);
  expect(marksOf([value(5), value(6), value(7)], Against.Majority)).toEqual([
    Different,
    Different,
    Different,
  ]);
  expect(marksOf([value(5), value(6)], Against.Majority)).toEqual([Different, Different]);
});

it("counts no missing value for a vote, nor a number for a text", () => {
  expect(marksOf([unread, unread, value(6)], Against.Majority)).toEqual([Apart, Apart, Same]);
  expect(marksOf([value(5), value("5")], Against.Majority)).toEqual([Different, Different]);
});
