/**
 * Pending changes: what a person wants to write and has not written yet. Kept for the whole page and over a reload,
 * one heap a turbine. The server's job says what became of them; only then do they go, and an undo set stays.
 */
import type { Failure, Job, Raw } from "../api/types";

export interface Change {
  device: string;
  address: string;
  raw: Raw;
  /** What RAM held when the change was made; null where that was not known. */
  from: Raw | null;
  atMs: number;
  /** Why the last try to write it failed. */
  refused: Failure | null;
}

export interface UndoRow {
  device: string;
  address: string;
  /** What RAM held before, and what was written. */
  was: Raw;
  written: Raw;
}

export interface UndoSet {
  id: string;
  atMs: number;
  rows: UndoRow[];
}

/** A write that runs: its job, and what was sent by key, as a change may be made anew meanwhile. */
export interface Writing {
  job: string;
  sent: Record<string, Raw>;
}

/** A write that has ended, kept until its outcome was looked at. */
export interface Outcome {
  job: Job;
  sent: Record<string, Raw>;
}

export interface StagedState {
  changes: ReadonlyMap<string, Change>;
  undo: readonly UndoSet[];
  writing: Writing | null;
  outcome: Outcome | null;
}

export type Keeper = Pick<Storage, "getItem" | "setItem">;

export const MOST_UNDO_SETS = 10;
export const NOTHING_STAGED: StagedState = { changes: new Map(), undo: [], writing: null, outcome: null };
const WRITTEN: readonly Job["rows"][number]["state"][] = [
  "verified",
  "unproven",
  "saving",
  "saved",
  "not_saved",
];

export const keyOf = (device: string, address: string): string => `${device} ${address}`;

export class StagedStore {
  state: StagedState = NOTHING_STAGED;
  private place: string | null = null;
  private readonly listeners = new Set<() => void>();

  constructor(
    private readonly keeper: Keeper,
    private readonly nowMs: () => number,
  ) {}

  readonly subscribe = (listener: () => void): (() => void) => {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  };

  /** Turns to the changes of a turbine. */
  open(turbine: string): void {
    const place = `hubside.staged.${turbine}`;
    if (place === this.place) return;
    this.place = place;
    this.state = read(this.keeper.getItem(place));
    this.tell();
  }

  get(device: string, address: string): Change | undefined {
    return this.state.changes.get(keyOf(device, address));
  }

  stage(changes: readonly Omit<Change, "refused">[]): void {
    const next = new Map(this.state.changes);
    for (const change of changes) {
      const key = keyOf(change.device, change.address);
      // Back to what RAM holds is no change any more.
      if (change.raw === change.from) next.delete(key);
      else next.set(key, { ...change, refused: null });
    }
    this.put({ changes: next });
  }

  drop(keys: readonly string[]): void {
    const next = new Map(this.state.changes);
    for (const key of keys) next.delete(key);
    this.put({ changes: next });
  }

  /** The person has seen that RAM holds another value now, and wants the change all the same. */
  confirm(key: string, found: Raw): void {
    const change = this.state.changes.get(key);
    if (!change) return;
    this.put({
      changes: new Map(this.state.changes).set(key, { ...change, from: found, refused: null }),
    });
  }

  begin(job: string, changes: readonly Change[]): void {
    const sent = Object.fromEntries(changes.map((one) => [keyOf(one.device, one.address), one.raw]));
    this.put({ writing: { job, sent }, outcome: null });
  }

  /** Nothing more will be heard of the job: the changes stay as they are. */
  forgetJob(): void {
    this.put({ writing: null });
  }

  /** The outcome of the last write was looked at. */
  dismiss(): void {
    this.put({ outcome: null });
  }

  /** Takes out what was written, marks what was refused, leaves what was not begun; gives the undo set. */
  finish(job: Job): UndoSet | null {
    if (this.state.writing?.job !== job.id) return null;
    const { sent } = this.state.writing;
    const changes = new Map(this.state.changes);
    const undone: UndoRow[] = [];
    for (const row of job.rows) {
      const key = keyOf(row.device, row.address);
      const raw = sent[key];
      const change = changes.get(key);
      if (raw === undefined) continue;
      if (row.state === "refused") {
        if (change) changes.set(key, { ...change, refused: row.error });
      } else if (WRITTEN.includes(row.state)) {
        if (change?.raw === raw) changes.delete(key);
        if (row.was_raw !== null && row.was_raw !== raw)
          undone.push({ device: row.device, address: row.address, was: row.was_raw, written: raw });
      }
    }
    const set = undone.length === 0 ? null : { id: job.id, atMs: this.nowMs(), rows: undone };
    const undo = set === null ? this.state.undo : [set, ...this.state.undo].slice(0, MOST_UNDO_SETS);
    this.put({ changes, undo, writing: null, outcome: { job, sent } });
    return set;
  }

  /** Stages the values from before a write; what is pending already for an object gives way. */
  undo(set: UndoSet): void {
    this.stage(
      [...set.rows].reverse().map(({ device, address, was, written }) => ({
        device,
        address,
        raw: was,
        from: written,
        atMs: this.nowMs(),
      })),
    );
  }

  private put(change: Partial<StagedState>): void {
    this.state = { ...this.state, ...change };
    if (this.place !== null) this.keeper.setItem(this.place, written(this.state));
    this.tell();
  }

  private tell(): void {
    for (const listener of [...this.listeners]) listener();
  }
}

function written(state: StagedState): string {
  return JSON.stringify({ ...state, changes: [...state.changes.values()] });
}

/** What an earlier page left; nothing where it cannot be read. */
function read(text: string | null): StagedState {
  if (text === null) return NOTHING_STAGED;
  try {
    const kept = JSON.parse(text) as Omit<StagedState, "changes"> & { changes: Change[] };
    const changes = new Map(kept.changes.map((one) => [keyOf(one.device, one.address), one]));
    return { changes, undo: kept.undo, writing: kept.writing, outcome: kept.outcome };
  } catch {
    return NOTHING_STAGED;
  }
}
