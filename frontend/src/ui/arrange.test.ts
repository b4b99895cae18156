import { createElement } from "react";
import { renderToStaticMarkup } from "react-dom/server";
import { describe, expect, it } from "vitest";
import { type ArrangedTable, inHeldOrder, leastWidth, type TableColumn, useArranged } from "./arrange";

interface Row {
  name: string;
  size: number | null;
  kind: string;
}

const rows: readonly Row[] = [
  { name: "wtg-10", size: 5, kind: "b" },
  { name: "wtg-2", size: null, kind: "a" },
  { name: "Wtg-3", size: 40, kind: "b" },
];
const columns: readonly TableColumn<Row>[] = [
  { id: "name", title: "Name", width: "70px", text: (row) => row.name, fixed: true },
  {
    id: "size",
    title: "Size",
    width: "minmax(80px, 1fr)",
    text: (row) => `${row.size} MB`,
    by: (row) => row.size,
  },
  { id: "kind", title: "Kind", width: "1fr", text: (row) => row.kind },
  { id: "download", title: "", width: "44px", text: () => "" },
];

interface View {
  find?: string;
  order?: string;
  less?: string;
  hiddenFirst?: readonly string[];
}

/** The table as a component has it in its render, and what it asks the URL to become. */
function tableOf({ find = "", order, less, hiddenFirst = [] }: View) {
  const asked: object[] = [];
  const seen: { table?: ArrangedTable<Row>; names?: string[]; ids?: string[] } = {};
  const Probe = () => {
    const view = { find, order, less };
    const table = useArranged({
      rows,
      columns,
      idOf: (row: Row) => row.name,
      view,
      onView: (change) => asked.push(change),
      hiddenFirst,
    });
    seen.table = table;
    seen.names = table.getRowModel().rows.map((line) => line.original.row.name);
    seen.ids = table.getVisibleLeafColumns().map((column) => column.id);
    return null;
  };
  renderToStaticMarkup(createElement(Probe));
  const column = (id: string) => {
    const found = seen.table?.getColumn(id);
    if (!found) throw new Error(`no column ${id}`);
    return found;
  };
  return { names: seen.names, ids: seen.ids, column, asked };
}

const names = (find: string, order?: string) =>
  tableOf({ find, ...(order === undefined ? {} : { order }) }).names;

describe("rows of a table", () => {
  it("keep their order until one is chosen", () => {
    expect(names("")).toEqual(["wtg-10", "wtg-2", "Wtg-3"]);
    expect(names("", "nothing")).toEqual(["wtg-10", "wtg-2", "Wtg-3"]);
  });

  it("hold every word of the filter, in any column and case", () => {
    expect(names("WTG 40")).toEqual(["Wtg-3"]);
    expect(names("10 40")).toEqual([]);
    expect(names("   ")).toHaveLength(3);
  });

  it("sort numbers by size and texts as people count, unknown first, both ways", () => {
    expect(names("", "size")).toEqual(["wtg-2", "wtg-10", "Wtg-3"]);
    expect(names("", "-size")).toEqual(["Wtg-3", "wtg-10", "wtg-2"]);
    expect(names("", "name")).toEqual(["wtg-2", "Wtg-3", "wtg-10"]);
  });

  it("stay as they came where they are alike, up as down", () => {
    expect(names("", "kind")).toEqual(["wtg-2", "wtg-10", "Wtg-3"]);
    expect(names("", "-kind")).toEqual(["wtg-10", "Wtg-3", "wtg-2"]);
  });

  it("stand still in an order that is held, and what is new comes last", () => {
    expect(inHeldOrder(["c", "new", "a", "b"], (row) => row, ["b", "gone", "a", "c"])).toEqual([
      "b",
      "a",
      "c",
      "new",
    ]);
  });
});

describe("columns of a table", () => {
  it("go up, down and back to as they came", () => {
    const next = (order?: string) => {
      const { column, asked } = tableOf(order === undefined ? {} : { order });
      column("size").toggleSorting();
      return asked;
    };
    expect(next()).toEqual([{ order: "size" }]);
    expect(next("name")).toEqual([{ order: "size" }]);
    expect(next("size")).toEqual([{ order: "-size" }]);
    expect(next("-size")).toEqual([{ order: undefined }]);
    expect(tableOf({}).column("download").getCanSort()).toBe(false);
  });

  it("are hidden by the URL, or at first, and never the fixed ones", () => {
    expect(tableOf({}).ids).toEqual(["name", "size", "kind", "download"]);
    expect(tableOf({ hiddenFirst: ["kind"] }).ids).toEqual(["name", "size", "download"]);
    expect(tableOf({ hiddenFirst: ["kind"], less: "none" }).ids).toEqual([
      "name",
      "size",
      "kind",
      "download",
    ]);
    expect(tableOf({ less: "name,size,other" }).ids).toEqual(["name", "kind", "download"]);
    expect(tableOf({}).column("name").getCanHide()).toBe(false);
  });

  it("are hidden and shown again through the URL", () => {
    const hide = tableOf({ less: "size" });
    hide.column("kind").toggleVisibility();
    expect(hide.asked).toEqual([{ less: "size,kind" }]);
    const show = tableOf({ less: "size" });
    show.column("size").toggleVisibility();
    expect(show.asked).toEqual([{ less: "none" }]);
  });

  it("are found by the filter even where they are hidden", () => {
    expect(tableOf({ find: "40", less: "size" }).names).toEqual(["Wtg-3"]);
  });

  it("need at least the widths of their tracks", () => {
    expect(leastWidth(columns, 10)).toBe(70 + 80 + 44 + 5 * 10);
  });
});
