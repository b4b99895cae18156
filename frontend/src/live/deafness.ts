/** Decides whether the page hears the bench. Times are milliseconds of one monotonic clock that is passed in. */

export const DEAF_AFTER_MS = 1000;

export interface Hearing {
  deaf: boolean;
  /** When the last message came; null where none has come yet. */
  lastHeardMs: number | null;
}

export class DeafnessTimer {
  private lastMs: number | null = null;
  private readonly startMs: number;

  constructor(startMs: number) {
    this.startMs = startMs;
  }

  heard(nowMs: number): void {
    this.lastMs = nowMs;
  }

  /** Before the first message the page is given the same second. */
  check(nowMs: number): Hearing {
    return { deaf: nowMs - (this.lastMs ?? this.startMs) > DEAF_AFTER_MS, lastHeardMs: this.lastMs };
  }
}
