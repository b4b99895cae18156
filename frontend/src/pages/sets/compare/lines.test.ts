import { expect, it } from "vitest";
import type { BitLine, RowDoc, RowState } from "../../../api/compare";
import { ALLOWED, type ComparedRow, keptRows, linesOf, Rows, shownBits, type View } from "./lines";

const row = (address: string, group: string, state: RowState, more: Partial<RowDoc> = {}): ComparedRow => {
  const doc = {
    address,
    group,
    state,
    bits: [],
    findings: [],
    found_in: {},
    cells: [],
    ...more,
  } as unknown as RowDoc;
  return {
    row: doc,
    known: null,
    title: address,
    groupTitle: group.toUpperCase(),
    haystack: `${address} ${group}`,
  };
};
const bit = (values: (number | null)[], differs: boolean) => ({ values, differs }) as unknown as BitLine;
const VIEW: View = {
  rows: Rows.Differences,
  filter: "",
  group: undefined,
  groups: ["b", "a"],
  closed: new Set(),
  expanded: new Set(),
  allowedTitle: "may differ",
};
const ROWS = [
  row("1", "a", "different"),
  row("2", "a", "same"),
  row("3", "b", "missing"),
  row("4", "b", "unit"),
  row("5", "c", "not-comparable"),
];
const ids = (view: Partial<View>) => linesOf(ROWS, { ...VIEW, ...view }).map((line) => line.id);

it("shows differences in the order of the groups, and what is bound to a unit apart, last", () => {
  expect(ids({})).toEqual(["group-b", "3", "group-a", "1", "group-c", "5", ALLOWED, "4"]);
  expect(ids({ rows: Rows.All })).toContain("2");
});

it("narrows by words and by group, and hides the rows of what is closed", () => {
  expect(keptRows(ROWS, { ...VIEW, filter: "1 A" }).map((one) => one.row.address)).toEqual(["1"]);
  expect(ids({ group: "a" })).toEqual(["group-a", "1"]);
  expect(ids({ closed: new Set(["group-b", ALLOWED]) })).toEqual([
    "group-b",
    "group-a",
    "1",
    "group-c",
    "5",
    ALLOWED,
  ]);
});

it("unfolds a row into its findings, the bits that say something, and its raw values", () => {
  const bits = [bit([1, 1], false), bit([0, 0], false), bit([0, 1], true), bit([null, 0], false)];
  const mask = row("9", "a", "different", { bits, findings: ["oat.rule"], found_in: { "oat.rule": [1] } });
  expect(shownBits(mask.row)).toEqual([bits[0], bits[2]]);
  const lines = linesOf([mask], { ...VIEW, expanded: new Set(["9"]) });
  expect(lines.map((line) => line.kind)).toEqual(["section", "row", "finding", "bit", "bit", "facts"]);
  expect(lines[2]).toMatchObject({ rule: "oat.rule", broken: [1] });
});
