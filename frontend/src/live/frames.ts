/**
 * The rows of the running trace that the page keeps, and what share of the traffic they are.
 *
 * Rows come in batches of the socket, older ones by pages of the API; both go through here, in order of time, and the
 * listeners are told at most once a tick. While paused nothing is added: what came meanwhile is counted.
 */
import type { TraceBatch, TraceLine, TracePage } from "../api/trace";

export const MAX_ROWS = 5000;
const RATE_WINDOW_MS = 2000;

/** Frames a second, by what became of them. */
export interface Rates {
  seen: number;
  matched: number;
  shown: number;
  sampled: boolean;
}

export interface TraceView {
  rows: readonly TraceLine[];
  /** Time at which the running trace began; null before its first batch. */
  startNs: number | null;
  rates: Rates;
  /** Frames that matched since the pause. */
  arrived: number;
  /** What is wrong with the filter. */
  invalid: string | null;
  /** There may be older and newer rows than the first and the last, and how far back was looked. */
  older: boolean;
  newer: boolean;
  reachedNs: number | null;
  source: TracePage["source"] | null;
}

interface Count {
  ms: number;
  seen: number;
  matched: number;
  sent: number;
  leftOut: number;
}

const EMPTY: TraceView = {
  rows: [],
  startNs: null,
  rates: { seen: 0, matched: 0, shown: 0, sampled: false },
  arrived: 0,
  invalid: null,
  older: true,
  newer: false,
  reachedNs: null,
  source: null,
};

export class FrameStore {
  view: TraceView = EMPTY;
  private id = 0;
  private paused = false;
  private pausedAt: number | null = null;
  private counts: Count[] = [];
  private readonly listeners = new Set<() => void>();
  private readonly schedule: (flush: () => void) => void;
  private scheduled = false;

  constructor(schedule: (flush: () => void) => void) {
    this.schedule = schedule;
  }

  subscribe = (listener: () => void): (() => void) => {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  };

  /** Forget all; batches of an earlier subscription are passed over. Gives the number of the new one. */
  begin(paused: boolean): number {
    this.id += 1;
    this.paused = paused;
    this.pausedAt = null;
    this.counts = [];
    this.change({ ...EMPTY, newer: paused });
    return this.id;
  }

  pause(): void {
    this.paused = true;
    this.change({ newer: true });
  }

  /** Go on with nothing: what came meanwhile is fetched by who shows it. */
  resume(): void {
    this.paused = false;
    this.pausedAt = null;
    this.change({ rows: [], arrived: 0, older: true, newer: false, reachedNs: null, source: null });
  }

  take(batch: TraceBatch, nowMs: number): void {
    if (batch.id !== this.id) return;
    // Another start: the server has begun anew, with another connection.
    const restarted = this.view.startNs !== null && this.view.startNs !== batch.start_t_ns;
    if (restarted) {
      this.counts = [];
      this.pausedAt = null;
      if (!this.paused) this.change({ ...EMPTY });
    }
    this.count(batch, nowMs);
    this.pausedAt ??= this.paused ? batch.matched : null;
    if (!this.paused) this.pausedAt = null;
    const rows = this.paused || batch.rows.length === 0 ? this.view.rows : this.appended(batch.rows);
    this.change({
      rows,
      startNs: batch.start_t_ns,
      rates: this.rates(),
      arrived: this.pausedAt === null ? 0 : batch.matched - this.pausedAt,
      invalid: batch.invalid,
    });
  }

  /** Rows of a page, before, behind or instead of those that are there. */
  merge(page: TracePage, where: "before" | "after" | "instead"): void {
    const { rows, older, newer } = this.view;
    const known = new Set(rows.map((row) => row.t_ns));
    const fresh = page.rows.filter((row) => !known.has(row.t_ns));
    if (where === "before") {
      this.change({
        rows: [...fresh, ...rows].slice(0, Math.max(MAX_ROWS, rows.length)),
        older: page.older,
        newer,
        reachedNs: page.from_t_ns,
        source: page.source,
      });
    } else if (where === "after") {
      this.change({ rows: [...rows, ...fresh].slice(-MAX_ROWS), older: true, newer: page.newer });
    } else {
      this.change({
        rows: page.rows,
        older: page.older,
        newer: page.newer || older,
        reachedNs: page.from_t_ns,
        source: page.source,
      });
    }
  }

  private appended(rows: readonly TraceLine[]): readonly TraceLine[] {
    // A page that was fetched meanwhile may hold the first of them already.
    const last = this.view.rows.at(-1)?.t_ns ?? 0;
    const all = [...this.view.rows, ...rows.filter((row) => row.t_ns > last)];
    return all.length > MAX_ROWS ? all.slice(-MAX_ROWS) : all;
  }

  private count(batch: TraceBatch, ms: number): void {
    const { seen, matched, sent, left_out: leftOut } = batch;
    this.counts.push({ ms, seen, matched, sent, leftOut });
    while (this.counts.length > 2 && (this.counts[1]?.ms ?? ms) < ms - RATE_WINDOW_MS) this.counts.shift();
  }

  private rates(): Rates {
    const [first, last] = [this.counts[0], this.counts.at(-1)];
    if (!first || !last || last.ms <= first.ms) return EMPTY.rates;
    const perSecond = (from: number, to: number) => ((to - from) * 1000) / (last.ms - first.ms);
    return {
      seen: perSecond(first.seen, last.seen),
      matched: perSecond(first.matched, last.matched),
      shown: perSecond(first.sent, last.sent),
      sampled: last.leftOut > first.leftOut,
    };
  }

  private change(parts: Partial<TraceView>): void {
    this.view = { ...this.view, ...parts };
    if (this.scheduled) return;
    this.scheduled = true;
    this.schedule(() => {
      this.scheduled = false;
      for (const listener of [...this.listeners]) listener();
    });
  }
}
