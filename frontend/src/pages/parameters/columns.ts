/** The columns of the parameter table: how wide, how sorted, and what text they give to copy and export. */
import type { Raw } from "../../api/types";
import type { ParameterRow } from "../../model/rows";
import { type DeviceContext, limitText, lineOf, shownOf } from "../../model/shown";
import { defaultOf, quantityOf } from "../../model/values";
import type { Translate } from "../../texts/texts";
import { rawOf } from "./cellValue";
import type { Bench } from "./context";
import { lastChangeOf } from "./history";
import { staged } from "./staging";

export enum Column {
  Star = "star",
  Address = "address",
  Name = "name",
  Unit = "unit",
  /** One for each device shown. */
  Ram = "ram",
  Stored = "stored",
  Default = "default",
  Limits = "limits",
  Access = "access",
  Changed = "changed",
  Section = "section",
}

/** One column as it stands in the table; `device` where it is about one of several devices. */
export interface ColumnSpec {
  id: string;
  column: Column;
  device: DeviceContext;
  label: string;
  track: string;
}

/** Tracks of the CSS grid. */
const WIDTHS: Record<Column, string> = {
  [Column.Star]: "40px",
  [Column.Address]: "80px",
  [Column.Name]: "minmax(180px, 2fr)",
  [Column.Unit]: "58px",
  [Column.Ram]: "minmax(150px, 1.15fr)",
  [Column.Stored]: "minmax(104px, 0.8fr)",
  [Column.Default]: "minmax(84px, 0.6fr)",
  [Column.Limits]: "minmax(112px, 0.7fr)",
  [Column.Access]: "62px",
  [Column.Changed]: "minmax(124px, 0.8fr)",
  [Column.Section]: "76px",
};
const SIDE_RAM = "minmax(122px, 1fr)";

const ALWAYS_SHOWN: readonly Column[] = [Column.Star, Column.Address, Column.Name, Column.Ram];
const SINGLE_ONLY: readonly Column[] = [Column.Stored];
const SIDE_ONLY: readonly Column[] = [Column.Unit];
export const HIDDEN_AT_FIRST: readonly string[] = [Column.Access, Column.Section, Column.Changed];

/** Columns that a person may hide. */
export const choicesOf = (side: boolean): Column[] =>
  Object.values(Column).filter(
    (one) => !ALWAYS_SHOWN.includes(one) && !(side ? SINGLE_ONLY : SIDE_ONLY).includes(one),
  );

export function columnsOf(
  { devices, side, nameOf }: Bench,
  hidden: readonly string[],
  t: Translate,
): ColumnSpec[] {
  const [first] = devices;
  if (!first) return [];
  const choices = choicesOf(side);
  return Object.values(Column).flatMap((column): ColumnSpec[] => {
    if (!ALWAYS_SHOWN.includes(column) && (!choices.includes(column) || hidden.includes(column))) return [];
    if (column === Column.Ram && side)
      return devices.map((device) => ({
        id: idOf(device),
        column,
        device,
        label: nameOf(device.slug),
        track: SIDE_RAM,
      }));
    return [
      { id: column, column, device: first, label: t(`page.table.column.${column}`), track: WIDTHS[column] },
    ];
  });
}

const idOf = (device: DeviceContext): string => `ram-${device.slug.split("/").slice(1).join("-")}`;

export interface Sorting {
  id: string;
  descending: boolean;
}

export function sortingOf(text: string | undefined): Sorting | null {
  if (!text) return null;
  return text.startsWith("-") ? { id: text.slice(1), descending: true } : { id: text, descending: false };
}

/** First up, then down, then as the description has it. */
export function nextSorting(id: string, now: Sorting | null): string | undefined {
  if (now?.id !== id) return id;
  return now.descending ? undefined : `-${id}`;
}

/** Values are compared as the store holds them at that moment: rows do not move while values change. */
export function sortRows(
  rows: readonly ParameterRow[],
  sorting: Sorting | null,
  columns: readonly ColumnSpec[],
  bench: Bench,
): readonly ParameterRow[] {
  const spec = columns.find((one) => one.id === sorting?.id);
  if (!spec || !sorting) return rows;
  const keyed = rows.map((row) => ({ row, key: sortKey(spec, row, bench) }));
  const sign = sorting.descending ? -1 : 1;
  keyed.sort((a, b) => sign * compareRaw(a.key, b.key) || a.row.order - b.row.order);
  return keyed.map((one) => one.row);
}

function sortKey({ column, device }: ColumnSpec, row: ParameterRow, bench: Bench): Raw | null {
  const { entry } = row;
  const cell = bench.store.cell(device.slug, entry.address);
  switch (column) {
    case Column.Star:
      return bench.starred.has(entry.address) ? 0 : 1;
    case Column.Address:
      return row.order;
    case Column.Name:
      return row.title;
    case Column.Unit:
      return entry.unit;
    case Column.Ram:
      return rawOf(cell);
    case Column.Stored:
      return cell?.stored?.raw ?? null;
    case Column.Default:
      return defaultOf(entry, device.node);
    case Column.Limits:
      return limitText(entry, device, false);
    case Column.Access:
      return entry.access;
    case Column.Changed:
      return lastChangeOf(entry.address, bench)?.change.t_ns ?? null;
    case Column.Section:
      return entry.section;
  }
}

const collator = new Intl.Collator(undefined, { numeric: true });

/** Unknown first, then numbers by size, then texts. */
export function compareRaw(a: Raw | null, b: Raw | null): number {
  if (a === null || b === null) return Number(a !== null) - Number(b !== null);
  if (typeof a === "number" && typeof b === "number") return a - b;
  return collator.compare(String(a), String(b));
}

/** Text of a cell for the clipboard and for files. */
export function cellText({ column, device }: ColumnSpec, row: ParameterRow, bench: Bench): string {
  const { entry } = row;
  const cell = bench.store.cell(device.slug, entry.address);
  const line = (raw: Raw | null) => (raw === null ? "" : lineOf(shownOf(entry, raw, device)));
  switch (column) {
    case Column.Star:
      return bench.starred.has(entry.address) ? "★" : "";
    case Column.Address:
      return entry.address;
    case Column.Name:
      return row.title;
    case Column.Unit:
      return quantityOf(entry, device.lookup).unit;
    case Column.Ram:
      return ramText(
        line,
        rawOf(cell),
        bench.recorded ? undefined : staged.get(device.slug, entry.address)?.raw,
      );
    case Column.Stored:
      return line(cell?.stored?.raw ?? null);
    case Column.Default:
      return line(defaultOf(entry, device.node));
    case Column.Limits:
      return limitText(entry, device, false);
    case Column.Access:
      return entry.access;
    case Column.Changed:
      return lastChangeText(entry.address, bench);
    case Column.Section:
      return entry.section;
  }
}

/** A pending value is told apart from what RAM holds, in a file as on the screen. */
function ramText(line: (raw: Raw | null) => string, ram: Raw | null, pending: Raw | undefined): string {
  return pending === undefined ? line(ram) : `${line(ram)} -> ${line(pending)}`;
}

function lastChangeText(address: string, bench: Bench): string {
  const last = lastChangeOf(address, bench);
  return last === null ? "" : `${new Date(last.change.t_ns / 1e6).toISOString()} ${last.change.person}`;
}
