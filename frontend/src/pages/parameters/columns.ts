/** The columns of the parameter table: how wide, how sorted, and what text they give to copy and export. */
import {
  columnVisibilityFeature,
  createColumnHelper,
  createSortedRowModel,
  rowSortingFeature,
  type SortFn,
  tableFeatures,
} from "@tanstack/react-table";
import type { Raw } from "../../api/types";
import { store } from "../../live/live";
import type { ParameterRow } from "../../model/rows";
import { type DeviceContext, limitText, lineOf, shownOf } from "../../model/shown";
import { defaultOf } from "../../model/values";
import { rawOf } from "./cellValue";

export const features = tableFeatures({
  columnVisibilityFeature,
  rowSortingFeature,
  sortedRowModel: createSortedRowModel(),
});

export enum Column {
  Address = "address",
  Name = "name",
  Ram = "ram",
  Stored = "stored",
  Default = "default",
  Limits = "limits",
  Access = "access",
  Section = "section",
}

/** Tracks of the CSS grid. */
export const WIDTHS: Record<Column, string> = {
  [Column.Address]: "84px",
  [Column.Name]: "minmax(190px, 2fr)",
  [Column.Ram]: "minmax(150px, 1.15fr)",
  [Column.Stored]: "minmax(112px, 0.8fr)",
  [Column.Default]: "minmax(92px, 0.6fr)",
  [Column.Limits]: "minmax(112px, 0.7fr)",
  [Column.Access]: "62px",
  [Column.Section]: "76px",
};

export const ALWAYS_SHOWN: readonly Column[] = [Column.Address, Column.Name, Column.Ram];
export const HIDDEN_AT_FIRST: readonly Column[] = [Column.Section];

interface Line {
  original: ParameterRow;
}

const helper = createColumnHelper<typeof features, ParameterRow>();

/** Sorting by value compares what the store holds at that moment: rows do not move while values change. */
export function columnsOf(context: DeviceContext) {
  const ram = (row: ParameterRow) => rawOf(store.cell(context.slug, row.entry.address));
  const stored = (row: ParameterRow) => store.cell(context.slug, row.entry.address)?.stored?.raw ?? null;
  const standard = (row: ParameterRow) => defaultOf(row.entry, context.node);
  const byRaw = (read: (row: ParameterRow) => Raw | null) => (a: Line, b: Line) =>
    compareRaw(read(a.original), read(b.original));
  const byText = (read: (row: ParameterRow) => string) => (a: Line, b: Line) =>
    read(a.original).localeCompare(read(b.original), context.t.language, { numeric: true });
  const column = (id: Column, sortFn: SortFn<typeof features, ParameterRow>) =>
    helper.accessor((row) => row.order, { id, sortFn });
  return helper.columns([
    column(Column.Address, (a, b) => a.original.order - b.original.order),
    column(
      Column.Name,
      byText((row) => row.title),
    ),
    column(Column.Ram, byRaw(ram)),
    column(Column.Stored, byRaw(stored)),
    column(Column.Default, byRaw(standard)),
    column(
      Column.Limits,
      byText((row) => limitText(row.entry, context, false)),
    ),
    column(
      Column.Access,
      byText((row) => row.entry.access),
    ),
    column(
      Column.Section,
      byText((row) => row.entry.section),
    ),
  ]);
}

/** Unknown first, then numbers by size, then texts. */
export function compareRaw(a: Raw | null, b: Raw | null): number {
  if (a === null || b === null) return Number(a !== null) - Number(b !== null);
  if (typeof a === "number" && typeof b === "number") return a - b;
  return String(a).localeCompare(String(b));
}

/** Text of a cell for the clipboard and for files. */
export function cellText(column: Column, row: ParameterRow, context: DeviceContext): string {
  const { entry } = row;
  const cell = store.cell(context.slug, entry.address);
  const line = (raw: Raw | null) => (raw === null ? "" : lineOf(shownOf(entry, raw, context)));
  switch (column) {
    case Column.Address:
      return entry.address;
    case Column.Name:
      return row.title;
    case Column.Ram:
      return line(rawOf(cell));
    case Column.Stored:
      return line(cell?.stored?.raw ?? null);
    case Column.Default:
      return line(defaultOf(entry, context.node));
    case Column.Limits:
      return limitText(entry, context, false);
    case Column.Access:
      return entry.access;
    case Column.Section:
      return entry.section;
  }
}
