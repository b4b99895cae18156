import { describe, expect, it } from "vitest";
import { arranged } from "./arrange";

const rows = [
  { name: "wtg-10", size: 5 },
  { name: "wtg-2", size: null },
  { name: "Wtg-3", size: 40 },
];
const columns = [
  { id: "name", text: (row: (typeof rows)[number]) => row.name },
  {
    id: "size",
    text: (row: (typeof rows)[number]) => `${row.size} MB`,
    by: (row: (typeof rows)[number]) => row.size,
  },
];
const names = (filter: string, order?: string) =>
  arranged(rows, columns, filter, order).map((row) => row.name);

describe("rows of a table", () => {
  it("keep their order until one is chosen", () => {
    expect(names("")).toEqual(["wtg-10", "wtg-2", "Wtg-3"]);
    expect(names("", "nothing")).toEqual(["wtg-10", "wtg-2", "Wtg-3"]);
  });

  it("hold every word of the filter, in any column and case", () => {
    expect(names("WTG 40")).toEqual(["Wtg-3"]);
    expect(names("10 40")).toEqual([]);
  });

  it("sort numbers by size and texts as people count, unknown first, both ways", () => {
    expect(names("", "size")).toEqual(["wtg-2", "wtg-10", "Wtg-3"]);
    expect(names("", "-size")).toEqual(["Wtg-3", "wtg-10", "wtg-2"]);
    expect(names("", "name")).toEqual(["wtg-2", "Wtg-3", "wtg-10"]);
  });
});
