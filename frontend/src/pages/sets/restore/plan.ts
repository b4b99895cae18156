/** The plan of a restore as rows of a table: in words, sorted by what becomes of each object, picked or not. */
import type { PlaceRef, PlanDoc, PlanRow } from "../../../api/restore";
import type { Raw } from "../../../api/types";
import { titleOf } from "../../../model/rows";
import { type DeviceContext, lineOf, shownOf } from "../../../model/shown";
import type { Translate } from "../../../texts/texts";
import { entriesOf } from "../../../ui/reading";

/** Which rows are shown. Differences: what is written, and what is not although it differs. */
export enum View {
  Differences = "differences",
  Written = "written",
  Skipped = "skipped",
  Equal = "equal",
  All = "all",
}

export const VIEWS = Object.values(View);

export interface PlanLine {
  id: string;
  row: PlanRow;
  /** What the device is called at its station: "PMC". */
  kind: string;
  title: string;
  groupTitle: string;
  now: string;
  wanted: string;
  /** What becomes of it, in words. */
  outcome: string;
  /** Ids of the broken rules that look at it. */
  rules: readonly string[];
  /** No order was found for it. */
  unordered: boolean;
}

export interface Group {
  id: string;
  title: string;
  lines: PlanLine[];
}

const DASH = "–";

export const idOf = (one: PlaceRef): string => `${one.device} ${one.address}`;

interface Words {
  t: Translate;
  contexts: ReadonlyMap<string, DeviceContext>;
  nameOf: (slug: string) => string;
}

export function linesOf(plan: PlanDoc, { t, contexts, nameOf }: Words): PlanLine[] {
  const rules = rulesByPlace(plan);
  const unordered = new Set(plan.unordered.map(idOf));
  return plan.rows.map((row) => {
    const context = contexts.get(row.device);
    const entry = context && entriesOf(context.doc).get(row.address);
    const id = idOf(row);
    const shown = (raw: Raw | null, plain: string | null) => {
      if (raw === null) return DASH;
      return entry ? lineOf(shownOf(entry, raw, context)) : withUnit(plain ?? String(raw), row.unit);
    };
    return {
      id,
      row,
      kind: nameOf(row.device),
      title: entry ? titleOf(entry, t) : row.name,
      groupTitle: row.group === "" ? DASH : t(`group.${row.group}`),
      now: shown(row.now_raw, row.now_shown),
      wanted: shown(row.wanted_raw, row.wanted_shown),
      outcome: outcomeOf(row, unordered.has(id), t),
      rules: rules.get(id) ?? [],
      unordered: unordered.has(id),
    };
  });
}

export const withUnit = (text: string, unit: string): string => (unit === "" ? text : `${text} ${unit}`);

function rulesByPlace(plan: PlanDoc): Map<string, string[]> {
  const found = new Map<string, string[]>();
  for (const finding of plan.findings) {
    if (finding.verdict !== "broken") continue;
    for (const place of finding.places) {
      const id = idOf(place);
      found.set(id, [...(found.get(id) ?? []), finding.rule]);
    }
  }
  return found;
}

function outcomeOf(row: PlanRow, unordered: boolean, t: Translate): string {
  if (unordered) return t("page.restoring.row.unordered");
  if (row.treatment !== "skip") return t(`page.restoring.row.${row.treatment}`);
  return row.why_key === null ? DASH : t(row.why_key, row.details);
}

/** Why an object is left out that a person may choose. */
const LEFT_OUT: readonly (string | null)[] = ["not-selected", "left-by-feather"];
/** Said of objects that no restore is about. */
const NO_MATTER: readonly (string | null)[] = ["read-only", "never", "not-in-set"];

/** True where a person may choose whether it is written. */
export const isPickable = ({ row }: PlanLine): boolean => row.treatment === "write" || isLeftOut(row.why);

export const isLeftOut = (why: string | null): boolean => LEFT_OUT.includes(why);

export const isPicked = ({ row }: PlanLine): boolean => row.treatment === "write";

/** Not written although the set holds another value than the device. */
const isLeftDifferent = ({ row }: PlanLine): boolean =>
  row.treatment === "skip" && row.wanted_raw !== null && !NO_MATTER.includes(row.why);

export function inView(line: PlanLine, view: View): boolean {
  switch (view) {
    case View.Differences:
      return line.row.treatment === "write" || isLeftDifferent(line);
    case View.Written:
      return line.row.treatment === "write";
    case View.Skipped:
      return line.row.treatment === "skip";
    case View.Equal:
      return line.row.treatment === "equal";
    case View.All:
      return true;
  }
}

/** Groups with something to pick, in the order in which they come. */
export function groupsOf(lines: readonly PlanLine[]): Group[] {
  const groups = new Map<string, Group>();
  for (const line of lines) {
    if (!isPickable(line)) continue;
    const id = line.row.group;
    const group = groups.get(id);
    if (group) group.lines.push(line);
    else groups.set(id, { id, title: line.groupTitle, lines: [line] });
  }
  return [...groups.values()];
}

/** What is picked once some lines are put in or taken out; undefined where all is picked. */
export function pick(
  lines: readonly PlanLine[],
  picked: ReadonlySet<string>,
  changed: readonly PlanLine[],
  on: boolean,
): ReadonlySet<string> | undefined {
  const next = new Set(picked);
  for (const { id } of changed) {
    if (on) next.add(id);
    else next.delete(id);
  }
  return lines.filter(isPickable).every(({ id }) => next.has(id)) ? undefined : next;
}

/** Stands in the URL where nothing is picked: an empty text would mean that nobody chose. */
const NOTHING = "-";

/** Addresses as the URL has them. Objects of PMM and PMC that a restore writes have no address in common. */
export function selectText(picked: ReadonlySet<string> | undefined): string | undefined {
  if (picked === undefined) return undefined;
  const addresses = [...picked].map((id) => id.slice(id.lastIndexOf(" ") + 1));
  return addresses.length === 0 ? NOTHING : [...new Set(addresses)].join(",");
}

export function selectedIn(text: string | undefined, devices: readonly string[]): PlaceRef[] | null {
  if (text === undefined) return null;
  if (text === NOTHING) return [];
  const addresses = text.split(",").filter(Boolean);
  return devices.flatMap((device) => addresses.map((address) => ({ device, address })));
}
