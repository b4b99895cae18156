import type { Cell } from "../../live/store";
import type { EntryDoc, Raw } from "../../api/types";
import { defaultOf } from "../../model/values";

/** What a device changes by itself (it can be mapped into a PDO) is fresh for so long; a parameter does not age. */
const PROCESS_FRESH_MS = 10_000;

export function rawOf(cell: Cell | undefined): Raw | null {
  return cell?.known === true ? cell.raw : null;
}

export function ageMsOf(cell: Cell, nowMs: number): number {
  return Math.max(0, nowMs - (cell.t_ns ?? 0) / 1e6);
}

export function isStale(entry: EntryDoc, cell: Cell, nowMs: number, silent: boolean): boolean {
  return silent || cell.stale || (entry.pdo && !entry.saved && ageMsOf(cell, nowMs) > PROCESS_FRESH_MS);
}

/**
 * True where the value in RAM would be kept by a save and is not what is stored. Where nothing is known of what is
 * stored: where it was written or became another one while this page looked.
 */
export function isUnsaved(entry: EntryDoc, cell: Cell | undefined): boolean {
  const raw = rawOf(cell);
  if (!entry.saved || !entry.writable || raw === null || !cell) return false;
  return cell.stored ? cell.stored.raw !== raw : cell.source === "sdo-write" || cell.changedAtMs !== null;
}

export function differsFromDefault(entry: EntryDoc, cell: Cell | undefined, node: number): boolean {
  const raw = rawOf(cell);
  const standard = defaultOf(entry, node);
  return raw !== null && standard !== null && raw !== standard;
}

/** True where a save would keep the value, and what is stored now is not known. */
export function isStoredUnknown(entry: EntryDoc, cell: Cell | undefined): boolean {
  return entry.saved && entry.writable && cell?.stored == null;
}
