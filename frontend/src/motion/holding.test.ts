import { describe, expect, it } from "vitest";
import type { Beat } from "../live/socket";
import { type Clock, Holding } from "./holding";

/** A clock that the test turns: the last timer that was asked for. */
class Timers implements Clock {
  ms: number | null = null;
  private work: () => void = () => undefined;

  every = (ms: number, work: () => void) => {
    this.ms = ms;
    this.work = work;
    return () => {
      if (this.work === work) this.ms = null;
    };
  };

  ring() {
    this.work();
  }
}

function page(open = true) {
  const sent: Beat[] = [];
  const clock = new Timers();
  const state = { open };
  const send = (beat: Beat) => {
    if (state.open) sent.push(beat);
    return state.open;
  };
  return { holding: new Holding("page", send, clock, () => 5), sent, clock, state };
}

describe("holding", () => {
  it("says nothing without a lease", () => {
    const { holding, sent, clock } = page();
    expect(holding.press(1)).toBe(false);
    expect(holding.next()).toBeNull();
    expect(sent).toEqual([]);
    expect(clock.ms).toBeNull();
  });

  it("is present every second, and holds every 100 ms, the first and the last beat at once", () => {
    const { holding, sent, clock } = page();
    holding.own(7);
    expect(clock.ms).toBe(1000);
    expect(holding.press(1)).toBe(true);
    expect(clock.ms).toBe(100);
    clock.ring();
    holding.letGo();
    expect(clock.ms).toBe(1000);
    clock.ring();
    expect(sent.map((beat) => beat.holding)).toEqual([true, true, false, false]);
    expect(sent.map((beat) => beat.number)).toEqual([1, 2, 3, 4]);
    expect(new Set(sent.map((beat) => `${beat.page} ${beat.fence}`))).toEqual(new Set(["page 7"]));
  });

  it("holds nothing where the server cannot be told", () => {
    const { holding, state, sent } = page();
    holding.own(7);
    state.open = false;
    expect(holding.press(1)).toBe(false);
    expect(holding.holding).toBe(false);
    state.open = true;
    holding.letGo();
    expect(sent).toEqual([]);
  });

  it("lets go with the lease, and counts anew with the next one", () => {
    const { holding, sent, clock } = page();
    holding.own(7);
    expect(holding.next()).toEqual({ fence: 7, order: 1 });
    expect(holding.next()).toEqual({ fence: 7, order: 2 });
    holding.press(1);
    holding.own(null);
    expect(holding.holding).toBe(false);
    expect(clock.ms).toBeNull();
    holding.own(8);
    expect(holding.next()).toEqual({ fence: 8, order: 1 });
    holding.press(1);
    expect(sent.at(-1)).toEqual({ page: "page", fence: 8, number: 1, holding: true, order: 1, sent_ms: 5 });
  });

  it("goes on counting where the same lease is had again", () => {
    const { holding, sent } = page();
    holding.own(7);
    holding.next();
    holding.press(1);
    holding.own(null);
    holding.own(7);
    expect(holding.next()).toEqual({ fence: 7, order: 2 });
    holding.press(2);
    expect(sent.at(-1)).toEqual({ page: "page", fence: 7, number: 2, holding: true, order: 2, sent_ms: 5 });
  });

  it("keeps what it has where the same lease is told again", () => {
    const { holding } = page();
    holding.own(7);
    holding.press(1);
    holding.own(7);
    expect(holding.holding).toBe(true);
  });
});
