/** The lines of a comparison's table: what differs, in groups as a technician looks; what may differ, apart from it. */
import type { BitLine, RowDoc, RowState } from "../../../api/compare";
import type { ParameterRow } from "../../../model/rows";

/** A row of the comparison, with what the description says of its object; null where no description knows it. */
export interface ComparedRow {
  row: RowDoc;
  known: ParameterRow | null;
  title: string;
  groupTitle: string;
  /** Lower case text that the filter searches. */
  haystack: string;
}

export interface SectionLine {
  kind: "section";
  id: string;
  title: string;
  count: number;
  open: boolean;
  /** Bound to one unit: these may differ. */
  allowed: boolean;
}
export interface RowLine {
  kind: "row";
  id: string;
  compared: ComparedRow;
  expanded: boolean;
  allowed: boolean;
}
export interface BitRow {
  kind: "bit";
  id: string;
  bit: BitLine;
  compared: ComparedRow;
}
export interface FindingLine {
  kind: "finding";
  id: string;
  rule: string;
  /** The columns in which it is broken. */
  broken: readonly number[];
}
export interface FactsLine {
  kind: "facts";
  id: string;
  compared: ComparedRow;
}

export type CompareLine = SectionLine | RowLine | BitRow | FindingLine | FactsLine;

/** The section of what is bound to one unit. */
export const ALLOWED = "unit";

export enum Rows {
  Differences = "differences",
  All = "all",
}

const CALM: readonly RowState[] = ["same"];

export interface View {
  rows: Rows;
  filter: string;
  /** One group alone, by its id. */
  group: string | undefined;
  groups: readonly string[];
  closed: ReadonlySet<string>;
  expanded: ReadonlySet<string>;
  allowedTitle: string;
}

export function keptRows(rows: readonly ComparedRow[], view: View): ComparedRow[] {
  const words = view.filter.toLowerCase().split(/\s+/).filter(Boolean);
  return rows.filter(
    ({ row, haystack }) =>
      (view.rows === Rows.All || !CALM.includes(row.state)) &&
      (view.group === undefined || row.group === view.group) &&
      words.every((word) => haystack.includes(word)),
  );
}

/** Groups in the order of the description, each with its rows; what is bound to one unit comes last. */
export function linesOf(rows: readonly ComparedRow[], view: View): CompareLine[] {
  const sections = new Map<string, ComparedRow[]>();
  for (const one of keptRows(rows, view)) {
    const id = one.row.state === "unit" ? ALLOWED : `group-${one.row.group}`;
    const list = sections.get(id);
    if (list) list.push(one);
    else sections.set(id, [one]);
  }
  const named = view.groups.map((group) => `group-${group}`);
  const rest = [...sections.keys()].filter((id) => id !== ALLOWED && !named.includes(id));
  return [...named, ...rest, ALLOWED].flatMap((id) => section(id, sections.get(id) ?? [], view));
}

function section(id: string, rows: readonly ComparedRow[], view: View): CompareLine[] {
  const [first] = rows;
  if (!first) return [];
  const allowed = id === ALLOWED;
  const open = !view.closed.has(id);
  const title = allowed ? view.allowedTitle : first.groupTitle;
  const head: SectionLine = { kind: "section", id, title, count: rows.length, open, allowed };
  return open ? [head, ...rows.flatMap((one) => rowLines(one, view.expanded, allowed))] : [head];
}

function rowLines(compared: ComparedRow, expandedRows: ReadonlySet<string>, allowed: boolean): CompareLine[] {
  const { row } = compared;
  const expanded = expandedRows.has(row.address);
  const head: RowLine = { kind: "row", id: row.address, compared, expanded, allowed };
  if (!expanded) return [head];
  return [
    head,
    ...row.findings.map((rule) => findingLine(row, rule)),
    ...shownBits(row).map((bit, at): BitRow => ({ kind: "bit", id: `${row.address}#${at}`, bit, compared })),
    { kind: "facts", id: `${row.address}?`, compared },
  ];
}

const findingLine = (row: RowDoc, rule: string): FindingLine => ({
  kind: "finding",
  id: `${row.address}!${rule}`,
  rule,
  broken: row.found_in[rule] ?? [],
});

/** Bits that are set anywhere or differ: the others of a mask of 32 say nothing. */
export const shownBits = (row: RowDoc): BitLine[] =>
  row.bits.filter((bit) => bit.differs || bit.values.some((one) => one !== null && one !== 0));
