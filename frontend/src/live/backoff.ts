/** Waiting times between attempts to connect: doubling from 0.25 s to 4 s, spread by a quarter against herds. */

const FIRST_MS = 250;
const LONGEST_MS = 4000;
const SPREAD = 0.25;

export class Backoff {
  private attempts = 0;
  private readonly random: () => number;

  constructor(random: () => number = Math.random) {
    this.random = random;
  }

  next(): number {
    const plainMs = Math.min(LONGEST_MS, FIRST_MS * 2 ** this.attempts);
    this.attempts += 1;
    return plainMs * (1 - SPREAD + 2 * SPREAD * this.random());
  }

  reset(): void {
    this.attempts = 0;
  }
}
