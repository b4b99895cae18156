import type { Cell } from "../../live/store";
import type { EntryDoc, Raw } from "../../api/types";
import { defaultOf } from "../../model/values";

/** A process value of a PDO is fresh for so long. What was read by SDO is as old as it says, but not stale by that. */
const PDO_FRESH_MS = 2000;

export function rawOf(cell: Cell | undefined): Raw | null {
  return cell?.known === true ? cell.raw : null;
}

export function isStale(cell: Cell, nowMs: number, silent: boolean): boolean {
  return silent || (cell.source.startsWith("pdo") && nowMs - cell.t_ns / 1e6 > PDO_FRESH_MS);
}

/** True where the value in RAM is known, is kept by a save, and is not what is stored as far as is known. */
export function isUnsaved(entry: EntryDoc, cell: Cell | undefined): boolean {
  const raw = rawOf(cell);
  return entry.saved && entry.writable && raw !== null && cell?.stored != null && cell.stored.raw !== raw;
}

export function differsFromDefault(entry: EntryDoc, cell: Cell | undefined, node: number): boolean {
  const raw = rawOf(cell);
  const standard = defaultOf(entry, node);
  return raw !== null && standard !== null && raw !== standard;
}
