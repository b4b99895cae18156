/** Rows of the parameter table: one an entry, with all that the filter searches, and groups as a technician looks. */
import type { DescriptionDoc, EntryDoc } from "../api/types";
import type { Translate } from "../texts/texts";

export interface ParameterRow {
  entry: EntryDoc;
  title: string;
  /** Name of the array or record it belongs to; null where it stands alone. */
  objectName: string | null;
  ownName: string;
  group: string;
  groupTitle: string;
  /** Lower case text that the filter searches. */
  haystack: string;
  /** Position in the description: the order of addresses. */
  order: number;
}

export interface GroupLine {
  kind: "group";
  id: string;
  title: string;
  count: number;
  open: boolean;
}

/** How many rows of each group have something to say. */
export type GroupTally = ReadonlyMap<string, { pending: number; different: number }>;

export interface EntryLine {
  kind: "entry";
  row: ParameterRow;
}

export type Line = GroupLine | EntryLine;

export function rowsOf(doc: DescriptionDoc, t: Translate): ParameterRow[] {
  return doc.entries.map((entry, order) => {
    const title = titleOf(entry, t);
    const groupTitle = t(`group.${entry.group}`);
    const haystack = haystackOf(doc, entry, title, groupTitle, t);
    const objectName = entry.kind === "var" ? null : t.nameOf(entry.object_name);
    return {
      entry,
      title,
      objectName,
      ownName: t.nameOf(entry.name),
      group: entry.group,
      groupTitle,
      order,
      haystack,
    };
  });
}

/** Name for people, translated piece by piece as the catalogue has it. */
export function titleOf(entry: EntryDoc, t: Translate): string {
  const name = t.nameOf(entry.name);
  return entry.kind === "var" ? name : `${t.nameOf(entry.object_name)}: ${name}`;
}

function haystackOf(
  doc: DescriptionDoc,
  entry: EntryDoc,
  title: string,
  groupTitle: string,
  t: Translate,
): string {
  const pieces = [
    entry.address,
    `${entry.address}h`,
    title,
    entry.title,
    entry.unit,
    groupTitle,
    entry.access,
  ];
  const bits = entry.bits === null ? [] : (doc.bit_tables[entry.bits] ?? []);
  const names = entry.enumeration === null ? [] : (doc.enumerations[entry.enumeration]?.values ?? []);
  for (const bit of bits) pieces.push(t(bit.text_key), bit.clamp ?? "");
  for (const name of names) pieces.push(t(name.text_key));
  return pieces.join("\n").toLowerCase();
}

/** Every word must be found somewhere; an empty filter keeps all. */
export function filterRows(rows: readonly ParameterRow[], filter: string): readonly ParameterRow[] {
  const words = filter.toLowerCase().split(/\s+/).filter(Boolean);
  if (words.length === 0) return rows;
  return rows.filter((row) => words.every((word) => row.haystack.includes(word)));
}

/** Groups in the order of the description, each followed by its rows in the order given, unless it is closed. */
export function linesOf(
  rows: readonly ParameterRow[],
  groups: readonly string[],
  closed: ReadonlySet<string>,
): Line[] {
  const byGroup = new Map<string, ParameterRow[]>();
  for (const row of rows) {
    const list = byGroup.get(row.group);
    if (list) list.push(row);
    else byGroup.set(row.group, [row]);
  }
  const order = [...groups, ...[...byGroup.keys()].filter((id) => !groups.includes(id))];
  return order.flatMap((id) => {
    const members = byGroup.get(id);
    if (!members?.[0]) return [];
    const open = !closed.has(id);
    const head: GroupLine = { kind: "group", id, title: members[0].groupTitle, count: members.length, open };
    return open ? [head, ...members.map((row): EntryLine => ({ kind: "entry", row }))] : [head];
  });
}
