/** The error memory of a device (1003h) as it was read, and what a text about an error points at. */
import type { DescriptionDoc, ErrorDoc, Raw } from "../../api/types";

type Lookup = (address: string) => Raw | null;

const ENTRIES = [1, 2, 3, 4, 5, 6, 7, 8];
/** Sub-index 0: the number of entries. */
export const COUNT = "1003";
const entryOf = (at: number) => `1003:0${at}`;
const stampOf = (at: number) => `2030:0${at}`;
/** A device that has it stamps its entries. */
export const STAMP = stampOf(1);
const LOW_WORD = 0x10000;

/** Everything that is read for it. */
export const MEMORY: readonly string[] = [COUNT, ...ENTRIES.flatMap((at) => [entryOf(at), stampOf(at)])];

export interface MemoryEntry {
  /** Its place, 1 is the newest. */
  at: number;
  /** The same error has the same key when newer ones have pushed it down. */
  key: string;
  /** null: not read. */
  code: number | null;
  raw: Raw | null;
  stamp: Raw | null;
}

/** The entries, newest first; null where it is not known how many there are. */
export function memoryOf(lookup: Lookup): MemoryEntry[] | null {
  const count = lookup(COUNT);
  if (typeof count !== "number") return null;
  const entries = ENTRIES.slice(0, count).map((at) => {
    const raw = lookup(entryOf(at));
    const stamp = lookup(stampOf(at));
    return { at, raw, stamp, code: typeof raw === "number" ? raw % LOW_WORD : null };
  });
  // Counted from the oldest: what arrives goes in at the other end.
  const sameOlder = (at: number, name: string) =>
    entries.filter((other) => other.at > at && nameOf(other) === name).length;
  return entries.map((entry) => ({
    ...entry,
    key: `${nameOf(entry)} ${sameOlder(entry.at, nameOf(entry))}`,
  }));
}

const nameOf = ({ raw, stamp }: { raw: Raw | null; stamp: Raw | null }) => `${raw}@${stamp}`;

export function errorIn(doc: DescriptionDoc, code: number): ErrorDoc | undefined {
  return doc.errors.find((one) => one.code === code);
}

/** A piece of a text; with an address where it names an object. */
export interface Piece {
  text: string;
  address: string | null;
}

/** `6065h` and `6510:04`, as the texts name objects; error codes look the same and are told apart by `isObject`. */
const ADDRESS = /\b(?:[0-9A-F]{4}h|[0-9A-F]{4}:[0-9A-F]{2})\b/g;

export function piecesOf(text: string, isObject: (address: string) => boolean): Piece[] {
  const pieces: Piece[] = [];
  let from = 0;
  const take = (upTo: number) => {
    if (upTo > from) pieces.push({ text: text.slice(from, upTo), address: null });
  };
  for (const match of text.matchAll(ADDRESS)) {
    const address = match[0].replace(/h$/, "");
    if (!isObject(address)) continue;
    take(match.index);
    pieces.push({ text: match[0], address });
    from = match.index + match[0].length;
  }
  take(text.length);
  return pieces;
}
