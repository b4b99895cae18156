/** Rows and columns of a comparison together with what the descriptions say of them. */
import { useQueries } from "@tanstack/react-query";
import { useMemo } from "react";
import type { CellDoc, ColumnDoc, ComparisonDoc, RowDoc } from "../../../api/compare";
import { knownDescriptionQuery } from "../../../api/sets";
import type { DescriptionDoc, EntryDoc, Raw } from "../../../api/types";
import { type ParameterRow, rowsOf } from "../../../model/rows";
import type { DeviceContext } from "../../../model/shown";
import { hexadecimal, isFloat, isHex, isInteger, localise, show } from "../../../model/values";
import { type Translate, useTexts } from "../../../texts/texts";
import { entriesOf } from "../../../ui/reading";
import type { ComparedRow } from "./lines";

export interface ColumnContext {
  column: ColumnDoc;
  at: number;
  /** null until the description is there, or where there is none. */
  device: DeviceContext | null;
}

export interface Compared {
  doc: ComparisonDoc;
  columns: ColumnContext[];
  rows: ComparedRow[];
  /** Groups in the order of the description. */
  groups: readonly string[];
}

/** null until the descriptions are there. */
export function useCompared(doc: ComparisonDoc | undefined): Compared | null {
  const t = useTexts();
  const ids = useMemo(() => [...new Set(doc?.columns.map((one) => one.description_id))], [doc]);
  const descriptions = useQueries({
    queries: ids.map((id) => knownDescriptionQuery(id)),
    combine: (results) => results.map((one) => ({ data: one.data, settled: !one.isPending })),
  });
  const settled = descriptions.every((one) => one.settled);
  const known = descriptions.flatMap((one) => one.data ?? []);
  const names = known.map((one) => `${one.id} ${one.version}`).join();
  // eslint-disable-next-line react-hooks/exhaustive-deps -- the same descriptions come as a new list every time
  const docs = useMemo(() => known, [names]);
  const objects = useMemo(() => objectsOf(docs, t), [docs, t]);
  return useMemo(() => {
    if (!doc || !settled) return null;
    return {
      doc,
      columns: doc.columns.map((column, at) => contextOf(doc, column, at, docs, t)),
      rows: doc.rows.map((row) => comparedOf(row, objects.get(row.address) ?? null, t)),
      groups: docs[0]?.groups.map((one) => one.id) ?? [],
    };
  }, [doc, settled, docs, objects, t]);
}

/** What the descriptions say of each object; the first that knows it speaks. */
function objectsOf(docs: readonly DescriptionDoc[], t: Translate): ReadonlyMap<string, ParameterRow> {
  const objects = new Map<string, ParameterRow>();
  for (const doc of docs)
    for (const row of rowsOf(doc, t))
      if (!objects.has(row.entry.address)) objects.set(row.entry.address, row);
  return objects;
}

function comparedOf(row: RowDoc, known: ParameterRow | null, t: Translate): ComparedRow {
  const title = known?.title ?? t.nameOf(row.name);
  const groupTitle = known?.groupTitle ?? (t.has(`group.${row.group}`) ? t(`group.${row.group}`) : row.group);
  const rules = row.findings.map((rule) => t(`rule.${rule}.title`));
  const haystack = [known?.haystack ?? `${row.address}\n${title}\n${groupTitle}`, ...rules];
  return { row, known, title, groupTitle, haystack: haystack.join("\n").toLowerCase() };
}

function contextOf(
  doc: ComparisonDoc,
  column: ColumnDoc,
  at: number,
  docs: readonly DescriptionDoc[],
  t: Translate,
): ColumnContext {
  const description = docs.find((one) => one.id === column.description_id);
  if (!description) return { column, at, device: null };
  let raws: ReadonlyMap<string, Raw | null> | null = null;
  const lookup = (address: string) => {
    raws ??= new Map(doc.rows.map((row) => [row.address, row.cells[at]?.raw ?? null]));
    return raws.get(address) ?? null;
  };
  return { column, at, device: { slug: column.device, node: 0, doc: description, t, lookup } };
}

const entryOf = (context: DeviceContext, address: string): EntryDoc | undefined =>
  entriesOf(context.doc).get(address);

/** Value with its unit; in words where an enumeration names it, with the names of its bits where it is a mask. */
export function cellText(row: RowDoc, at: number, t: Translate): string {
  const cell = row.cells[at];
  if (!cell) return "";
  if (cell.text_key !== null) return t(cell.text_key);
  const number = typeof cell.raw === "number" ? localise(cell.shown, t.language) : cell.shown;
  const plain = cell.unit === "" ? number : `${number} ${cell.unit}`;
  const names = row.bits
    .filter((bit) => bit.values[at] !== null && bit.values[at] !== 0)
    .map((bit) => bit.clamp || (bit.text_key === null ? `${bit.bit}` : t(bit.text_key)));
  return names.length === 0 ? plain || "“”" : `${plain} · ${names.join(", ")}`;
}

/** `510 · 01FEh`: what the object itself holds. */
export function rawText(row: RowDoc, cell: CellDoc, { device }: ColumnContext): string {
  const entry = device && entryOf(device, row.address);
  if (cell.raw === null) return "–";
  return entry && isInteger(entry) && typeof cell.raw === "number"
    ? `${cell.raw} · ${hexadecimal(entry, cell.raw)}`
    : String(cell.raw);
}

/** By how much a number is above or below the reference, in its unit; empty where that says nothing. */
export function deltaText(
  row: RowDoc,
  raw: Raw | null,
  reference: Raw | null,
  { device }: ColumnContext,
): string {
  const entry = device && entryOf(device, row.address);
  if (!entry || typeof raw !== "number" || typeof reference !== "number" || raw === reference) return "";
  if (isHex(entry) || entry.enumeration !== null || !(isInteger(entry) || isFloat(entry))) return "";
  const size = show(entry, Math.abs(raw - reference), device.lookup, device.t.language);
  return `${raw > reference ? "+" : "−"}${size}`;
}
