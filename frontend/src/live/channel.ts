/** What a page is shown: the bench, or a recording that is replayed. Each has its own store and its own subscription. */
import type { TraceFilter } from "../api/trace";
import { FrameStore } from "./frames";
import { LiveStore } from "./store";

export const LIVE = "live";
const REPLAY = "replay/";

/** Topics of every page; a replay has a cursor beside them. */
const TOPICS = ["link", "nodes", "axes", "rotor", "cylinders", "instructor", "motion", "events"];

export type Trace = TraceFilter & { id: number };

/** The context of a recording, and the recording of a context. */
export const contextOf = (replay: string): string => `${REPLAY}${replay}`;
export const replayOf = (ctx: string): string | null =>
  ctx.startsWith(REPLAY) ? ctx.slice(REPLAY.length) : null;

/** Where the API has what is read of a context. */
export function baseOf(ctx: string): string {
  const replay = replayOf(ctx);
  return replay === null ? "/api/live" : `/api/replay/${encodeURIComponent(replay)}`;
}

export class Channel {
  readonly ctx: string;
  readonly store: LiveStore;
  readonly frames: FrameStore;
  private readonly devices = new Map<string, number>();
  private trace: Trace | null = null;
  private changed: () => void = () => undefined;
  private gone: () => void = () => undefined;

  /** `pace` gives each store a schedule of its own. */
  constructor(ctx: string, pace: () => (flush: () => void) => void) {
    this.ctx = ctx;
    this.store = new LiveStore(pace(), () => Date.now(), ctx !== LIVE);
    this.frames = new FrameStore(pace());
  }

  get recorded(): boolean {
    return this.ctx !== LIVE;
  }

  /** Calls `changed` where another subscription is wanted, `gone` where the server does not know the context. */
  attach(changed: () => void, gone: () => void): void {
    this.changed = changed;
    this.gone = gone;
  }

  tellGone(): void {
    this.gone();
  }

  /** Ask for the values of a device; the answer ends it. */
  watchDevice(slug: string): () => void {
    this.devices.set(slug, (this.devices.get(slug) ?? 0) + 1);
    this.changed();
    return () => {
      const left = (this.devices.get(slug) ?? 1) - 1;
      if (left > 0) this.devices.set(slug, left);
      else this.devices.delete(slug);
      this.changed();
    };
  }

  /** Ask for the running trace; the answer ends it. There is one at a time. */
  watchTrace(filter: Trace): () => void {
    this.trace = filter;
    this.changed();
    return () => {
      if (this.trace !== filter) return;
      this.trace = null;
      this.changed();
    };
  }

  /** The message that subscribes to all that is wanted. */
  request(): object {
    const { ctx, trace } = this;
    const topics = [...TOPICS, ...[...this.devices.keys()].map((slug) => `values:${slug}`)];
    if (this.recorded) topics.push("cursor");
    if (trace !== null) topics.push("trace");
    return { type: "subscribe", ctx, topics, ...(trace === null ? {} : { trace }) };
  }
}
