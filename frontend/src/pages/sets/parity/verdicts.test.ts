import { expect, it } from "vitest";
import type { ColumnDoc, RowDoc } from "../../../api/compare";
import { verdictsOf } from "./verdicts";

const row = (state: RowDoc["state"], raws: number[]) =>
  ({ state, cells: raws.map((raw) => ({ state: "value", raw })) }) as RowDoc;
const COLUMNS = [{ spec: "a" }, { spec: "b" }, { spec: "c" }] as ColumnDoc[];
const counts = (rows: RowDoc[]) => verdictsOf(COLUMNS, rows).map(({ alone, discord }) => [alone, discord]);

it("names the blade that differs where two agree", () => {
  expect(counts([row("different", [1, 2, 1]), row("different", [1, 3, 1]), row("same", [1, 1, 1])])).toEqual([
    [0, 0],
    [2, 0],
    [0, 0],
  ]);
});

it("blames nobody alone where no two agree, and none for what is bound to a unit", () => {
  expect(counts([row("different", [1, 2, 3]), row("unit", [1, 2, 2])])).toEqual([
    [0, 1],
    [0, 1],
    [0, 1],
  ]);
});
