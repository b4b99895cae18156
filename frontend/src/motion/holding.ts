/**
 * The dead man of this page: who has the lease says so every second, and every 100 ms while something is held.
 *
 * Whatever keeps the page from running keeps its beats back too, and the server stops the axis. A page that is hidden,
 * or loses the focus, lets go by itself.
 */
import type { Beat } from "../live/socket";

export const BEAT_MS = 100;
const PRESENT_MS = 1000;

export interface Clock {
  every: (ms: number, work: () => void) => () => void;
}

const browserClock: Clock = {
  every: (ms, work) => {
    const timer = setInterval(work, ms);
    return () => clearInterval(timer);
  },
};

const nowMs = () => performance.now();

export class Holding {
  /** The number of our lease; null without one. */
  fence: number | null = null;
  private counted: number | null = null;
  private number = 0;
  private order = 0;
  private held: number | null = null;
  private ends: (() => void) | null = null;
  private readonly page: string;
  private readonly send: (beat: Beat) => boolean;
  private readonly clock: Clock;
  private readonly nowMs: () => number;

  constructor(
    page: string,
    send: (beat: Beat) => boolean,
    clock: Clock = browserClock,
    now: () => number = nowMs,
  ) {
    this.nowMs = now;
    this.page = page;
    this.send = send;
    this.clock = clock;
  }

  get holding(): boolean {
    return this.held !== null;
  }

  /** Another lease, or none: nothing is held any more. The numbers of a lease go on where it is had again. */
  own(fence: number | null): void {
    if (fence === this.fence) return;
    this.fence = fence;
    this.held = null;
    if (fence !== null && fence !== this.counted) {
      this.counted = fence;
      this.number = this.order = 0;
    }
    this.beatEvery(fence === null ? null : PRESENT_MS);
  }

  /** The numbers of the next order; null without a lease. */
  next(): { fence: number; order: number } | null {
    if (this.fence === null) return null;
    this.order += 1;
    return { fence: this.fence, order: this.order };
  }

  /** Hold what `order` has the axis do; the first beat goes at once. False where the server cannot be told. */
  press(order: number): boolean {
    if (this.fence === null) return false;
    this.held = order;
    if (!this.beat()) {
      this.held = null;
      return false;
    }
    this.beatEvery(BEAT_MS);
    return true;
  }

  /** Let go; said at once. */
  letGo(): void {
    if (this.held === null) return;
    this.held = null;
    this.beat();
    this.beatEvery(this.fence === null ? null : PRESENT_MS);
  }

  private beatEvery(ms: number | null): void {
    this.ends?.();
    this.ends = ms === null ? null : this.clock.every(ms, () => this.beat());
  }

  private beat(): boolean {
    if (this.fence === null) return false;
    this.number += 1;
    return this.send({
      page: this.page,
      fence: this.fence,
      number: this.number,
      holding: this.held !== null,
      order: this.held ?? 0,
      sent_ms: this.nowMs(),
    });
  }
}
