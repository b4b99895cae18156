import { expect, it } from "vitest";
import type { CellDoc } from "../../../api/compare";
import { Against, cellMarks, Mark, marksOf } from "./marks";

const { Reference, Same, Different, Apart } = Mark;

it("holds all columns against the first", () => {
  expect(marksOf([1, 1, 2, null], Against.Reference)).toEqual([Reference, Same, Different, Apart]);
  expect(marksOf([null, 1], Against.Reference)).toEqual([Reference, Apart]);
});

it("marks the blade that differs where two agree, and all where none do", () => {
  expect(marksOf([5, 6, 5], Against.Majority)).toEqual([Same, Different, Same]);
  expect(marksOf([5, 6, 7], Against.Majority)).toEqual([Different, Different, Different]);
  expect(marksOf([5, 6], Against.Majority)).toEqual([Different, Different]);
});

it("counts no missing value for a vote, nor a number for a text", () => {
  expect(marksOf([null, null, 6], Against.Majority)).toEqual([Apart, Apart, Same]);
  expect(marksOf([5, "5"], Against.Majority)).toEqual([Different, Different]);
});

it("takes a cell for a value only where it says so", () => {
  const cell = (state: CellDoc["state"], raw: number | null) =>
    ({ state, raw, shown: "", unit: "", text_key: null, reason: "" }) satisfies CellDoc;
  const cells = [cell("value", 5), cell("unread", null), cell("empty", null), cell("value", 0)];
  expect(cellMarks(cells, Against.Reference)).toEqual([Reference, Apart, Apart, Different]);
});
