/** What a person wants of the PDOs of a device, beside how they are set up: kept while the page is open. */
import { useSyncExternalStore } from "react";
import type { Pdo, PdoEdit, PdoMapped, PdoSetup } from "../../../api/pdo";

export const COB_INVALID = 0x80000000;
export const COB_NO_RTR = 0x40000000;
const COB_EXTENDED = 0x20000000;
const LAST_BASE_ID = 0x7ff;
const LAST_ID = 0x1fffffff;
export const MAX_BITS = 64;
/** Up to here an index is a data type that only fills bits. */
const LAST_DUMMY = 0x1f;

export type PdoName = `${"rpdo" | "tpdo"}${number}`;
type Edits = ReadonlyMap<PdoName, PdoEdit>;

export const nameOf = (pdo: { direction: "rpdo" | "tpdo"; number: number }): PdoName =>
  `${pdo.direction}${pdo.number}`;
export const titleOfPdo = (pdo: { direction: string; number: number }) =>
  `${pdo.direction.toUpperCase()}${pdo.number}`;

export const isEnabled = (setup: PdoSetup) => setup.cob_id < COB_INVALID;
export const bitsOf = (setup: PdoSetup) => setup.mapped.reduce((sum, one) => sum + one.bits, 0);
export const isDummy = (mapped: PdoMapped) => parseInt(mapped.object, 16) <= LAST_DUMMY;

const has = (setup: PdoSetup, flag: number) => Math.floor(setup.cob_id / flag) % 2 === 1;
export const allowsRemote = (setup: PdoSetup) => !has(setup, COB_NO_RTR);
export const canIdOf = (setup: PdoSetup) =>
  setup.cob_id % (has(setup, COB_EXTENDED) ? COB_EXTENDED : LAST_BASE_ID + 1);

function withFlag(setup: PdoSetup, flag: number, on: boolean): PdoSetup {
  if (has(setup, flag) === on) return setup;
  return { ...setup, cob_id: setup.cob_id + (on ? flag : -flag) };
}

export const withEnabled = (setup: PdoSetup, on: boolean) => withFlag(setup, COB_INVALID, !on);
export const withRemote = (setup: PdoSetup, on: boolean) => withFlag(setup, COB_NO_RTR, !on);

/** Another identifier; one above 7FFh is a 29-bit one. The other bits stay. */
export function withCanId(setup: PdoSetup, canId: number): PdoSetup {
  const flags = (has(setup, COB_INVALID) ? COB_INVALID : 0) + (has(setup, COB_NO_RTR) ? COB_NO_RTR : 0);
  return { ...setup, cob_id: flags + (canId > LAST_BASE_ID ? COB_EXTENDED : 0) + canId };
}

/** `291`, `291h` and `0x291` are the same; null where it is none. */
export function parseCanId(text: string): number | null {
  const match = /^(?:0x)?([0-9a-f]{1,8})h?$/i.exec(text.trim());
  const id = match ? parseInt(match[1] ?? "", 16) : NaN;
  return Number.isFinite(id) && id <= LAST_ID ? id : null;
}

export const hexId = (id: number) => id.toString(16).toUpperCase().padStart(3, "0");

/** The list with one entry at another place. */
export function moved<T>(list: readonly T[], from: number, to: number): T[] {
  const rest = [...list];
  const [one] = rest.splice(from, 1);
  if (one === undefined) return [...list];
  rest.splice(Math.max(0, Math.min(rest.length, to)), 0, one);
  return rest;
}

const same = (one: PdoSetup, other: PdoSetup) => JSON.stringify(one) === JSON.stringify(other);

const NONE: Edits = new Map();

class EditStore {
  #devices: ReadonlyMap<string, Edits> = new Map();
  readonly #listeners = new Set<() => void>();

  readonly subscribe = (listener: () => void) => {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  };

  of(device: string): Edits {
    return this.#devices.get(device) ?? NONE;
  }

  /** What is wanted of a PDO; wanting what stands there anyway is no edit. */
  want(device: string, pdo: Pdo, wanted: PdoSetup): void {
    if (pdo.setup === null) return;
    const edits = new Map(this.of(device));
    const base = edits.get(nameOf(pdo))?.base ?? pdo.setup;
    if (same(base, wanted)) edits.delete(nameOf(pdo));
    else edits.set(nameOf(pdo), { direction: pdo.direction, number: pdo.number, base, wanted });
    this.#put(device, edits);
  }

  discard(device: string): void {
    this.#put(device, NONE);
  }

  #put(device: string, edits: Edits): void {
    this.#devices = new Map([...this.#devices, [device, edits]]);
    for (const listener of [...this.#listeners]) listener();
  }
}

export const pdoEdits = new EditStore();

export const usePdoEdits = (device: string) =>
  useSyncExternalStore(pdoEdits.subscribe, () => pdoEdits.of(device));
