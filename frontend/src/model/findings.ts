/** What speaks against a pending change, or should be known before it is written. */
import type { BitDoc, DescriptionDoc, Details, EntryDoc, Raw, Session } from "../api/types";
import { fieldOf } from "./bits";
import { lockOf } from "./locks";
import type { Change } from "./staged";
import { limitsOf, type Lookup, Misfit, misfitOf, restsOn } from "./values";

export enum Weight {
  /** The server would refuse it: it cannot be written as it is. */
  Stops = "stops",
  /** A person must say for this row that it is meant. */
  Asks = "asks",
  Warns = "warns",
  Tells = "tells",
}

export enum FindingKind {
  Limit = "limit",
  NotListed = "not_listed",
  Locked = "locked",
  Precondition = "precondition",
  Conflict = "conflict",
  UnknownRam = "unknown_ram",
  UnknownLimit = "unknown_limit",
  UnknownPrecondition = "unknown_precondition",
  Unit = "unit",
  Dependent = "dependent",
  SharedClamp = "shared_clamp",
  NotKept = "not_kept",
  Same = "same",
}

export interface Finding {
  kind: FindingKind;
  weight: Weight;
  /** Address of another object that it is about. */
  other: string | null;
  details: Details;
}

/** What is known of the device: its description, what RAM holds, and who asks. */
export interface Ground {
  doc: DescriptionDoc;
  entries: ReadonlyMap<string, EntryDoc>;
  ram: Lookup;
  role: Session["role"];
}

export interface PlannedRow {
  change: Change;
  findings: Finding[];
}

/**
 * Puts the changes of one device in an order in which each is valid at its turn, staged order first, and says what
 * speaks against each. What fits at no turn comes last.
 */
export function planOf(changes: readonly Change[], ground: Ground): PlannedRow[] {
  const planned = new Map<string, Raw>();
  const after: Lookup = (address) => planned.get(address) ?? ground.ram(address);
  const waiting = [...changes];
  const rows: PlannedRow[] = [];
  while (waiting.length > 0) {
    const fits = waiting.findIndex((change) => fitsNow(change, ground, after));
    const [change] = waiting.splice(Math.max(0, fits), 1);
    if (!change) break;
    rows.push({ change, findings: ownFindings(change, ground, after) });
    planned.set(change.address, change.raw);
  }
  for (const row of rows) row.findings.push(...effects(row.change, ground, after, planned));
  return rows;
}

export const stops = (row: PlannedRow): boolean => row.findings.some((one) => one.weight === Weight.Stops);
export const asks = (row: PlannedRow): boolean => row.findings.some((one) => one.weight === Weight.Asks);

function fitsNow({ address, raw }: Change, ground: Ground, lookup: Lookup): boolean {
  const entry = ground.entries.get(address);
  return (
    entry !== undefined &&
    misfitOf(ground.doc, entry, raw, lookup) === null &&
    unmet(entry, raw, lookup).length === 0
  );
}

/** Conditions of a write of `raw` that are known not to hold; with null those of any write. */
export const unmet = (entry: EntryDoc, raw: Change["raw"] | null, lookup: Lookup) =>
  entry.requires.filter(({ address, values, writing = [] }) => {
    if (writing.length > 0 && !(typeof raw === "number" && writing.includes(raw))) return false;
    const found = lookup(address);
    return typeof found === "number" && !values.includes(found);
  });

function ownFindings(change: Change, ground: Ground, lookup: Lookup): Finding[] {
  const entry = ground.entries.get(change.address);
  if (!entry) return [finding(FindingKind.Locked, Weight.Stops, null, { lock: "gone" })];
  const ram = ground.ram(change.address);
  const found: Finding[] = [];
  const lock = lockOf(entry, ground.role);
  if (lock !== null) found.push(finding(FindingKind.Locked, Weight.Stops, null, { lock }));
  const why = misfitOf(ground.doc, entry, change.raw, lookup);
  if (why === Misfit.NotListed) found.push(finding(FindingKind.NotListed, Weight.Stops, null, {}));
  else if (why !== null)
    found.push(finding(FindingKind.Limit, Weight.Stops, null, { ...limitsOf(entry, lookup) }));
  for (const one of unmet(entry, change.raw, lookup))
    found.push(finding(FindingKind.Precondition, Weight.Stops, one.address, { values: one.values }));
  if (entry.readable && ram !== null && change.from !== null && ram !== change.from)
    found.push(finding(FindingKind.Conflict, Weight.Asks, null, { from: change.from, found: ram }));
  if (ram === change.raw) found.push(finding(FindingKind.Same, Weight.Tells, null, {}));
  if (entry.readable && ram === null) found.push(finding(FindingKind.UnknownRam, Weight.Warns, null, {}));
  return [...found, ...unknowns(entry, lookup), ...ofClass(entry)];
}

function unknowns(entry: EntryDoc, lookup: Lookup): Finding[] {
  const conditions = new Set(entry.requires.map((one) => one.address));
  return restsOn(entry)
    .filter((address) => lookup(address) === null)
    .map((address) =>
      finding(
        conditions.has(address) ? FindingKind.UnknownPrecondition : FindingKind.UnknownLimit,
        Weight.Warns,
        address,
        {},
      ),
    );
}

function ofClass(entry: EntryDoc): Finding[] {
  const found: Finding[] = [];
  if (entry.restore === "unit") found.push(finding(FindingKind.Unit, Weight.Warns, null, {}));
  if (!entry.saved) found.push(finding(FindingKind.NotKept, Weight.Tells, null, {}));
  return found;
}

/** What the change does to others: values that it leaves outside their limits, and clamps that another mask has too. */
function effects(
  change: Change,
  ground: Ground,
  after: Lookup,
  planned: ReadonlyMap<string, Raw>,
): Finding[] {
  const entry = ground.entries.get(change.address);
  if (!entry) return [];
  return [...strandedBy(entry, ground, after, planned), ...sharedClamps(entry, change.raw, ground, after)];
}

function strandedBy(
  entry: EntryDoc,
  ground: Ground,
  after: Lookup,
  planned: ReadonlyMap<string, Raw>,
): Finding[] {
  return ground.doc.entries
    .filter((other) => !planned.has(other.address) && limitAddresses(other).includes(entry.address))
    .filter((other) => {
      const raw = ground.ram(other.address);
      return (
        raw !== null &&
        misfitOf(ground.doc, other, raw, ground.ram) === null &&
        misfitOf(ground.doc, other, raw, after) !== null
      );
    })
    .map((other) => finding(FindingKind.Dependent, Weight.Warns, other.address, {}));
}

const limitAddresses = (entry: EntryDoc): string[] =>
  [entry.minimum, entry.maximum].flatMap((limit) =>
    limit !== null && typeof limit === "object" ? [limit.address] : [],
  );

/** Clamps that this mask gives out and that another mask of the same kind gives out as well. */
export function sharedClamps(entry: EntryDoc, raw: Raw, ground: Ground, lookup: Lookup): Finding[] {
  if (entry.bits === null || typeof raw !== "number" || !entry.saved) return [];
  const table = (ground.doc.bit_tables[entry.bits] ?? []).filter((bit) => bit.clamp);
  const mine = clampsOf(entry, raw, table);
  if (mine.length === 0) return [];
  const found: Finding[] = [];
  for (const other of ground.doc.entries) {
    if (other.bits !== entry.bits || other === entry || !other.saved || other.access === "ro") continue;
    const theirs = lookup(other.address);
    if (typeof theirs !== "number") continue;
    const both = clampsOf(other, theirs, table).filter((clamp) => mine.includes(clamp));
    if (both.length > 0)
      found.push(finding(FindingKind.SharedClamp, Weight.Warns, other.address, { clamps: both.join(", ") }));
  }
  return found;
}

const clampsOf = (entry: EntryDoc, raw: number, table: readonly BitDoc[]): string[] =>
  table.filter((bit) => fieldOf(entry, raw, bit) !== 0).map((bit) => bit.clamp ?? "");

function finding(kind: FindingKind, weight: Weight, other: string | null, details: Details): Finding {
  return { kind, weight, other, details };
}
