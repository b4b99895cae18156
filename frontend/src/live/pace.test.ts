import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { DRAW_MS, paced } from "./pace";

const FRAME_MS = 16;

describe("what comes", () => {
  beforeEach(() => {
    vi.useFakeTimers();
    vi.stubGlobal("document", { hidden: false });
    vi.stubGlobal("requestAnimationFrame", (draw: () => void) => setTimeout(draw, FRAME_MS));
  });
  afterEach(() => {
    vi.useRealTimers();
    vi.unstubAllGlobals();
  });

  it("is drawn with the next frame after a pause", () => {
    const flush = vi.fn();
    paced()(flush);
    vi.advanceTimersByTime(FRAME_MS);
    expect(flush).toHaveBeenCalledTimes(1);
  });

  it("is drawn twenty times a second where it never ends", () => {
    const schedule = paced();
    let drawn = 0;
    const again = () => {
      drawn += 1;
      schedule(again);
    };
    schedule(again);
    vi.advanceTimersByTime(2000);
    expect(drawn).toBeGreaterThan(2000 / (DRAW_MS + 2 * FRAME_MS));
    expect(drawn).toBeLessThanOrEqual(2000 / DRAW_MS + 1);
  });

  it("is drawn slowly while nobody looks, and each store has a pace of its own", () => {
    const [one, other] = [vi.fn(), vi.fn()];
    const first = paced();
    first(one);
    vi.advanceTimersByTime(FRAME_MS);
    paced()(other);
    vi.advanceTimersByTime(FRAME_MS);
    expect(other).toHaveBeenCalledTimes(1);
    vi.stubGlobal("document", { hidden: true });
    first(one);
    vi.advanceTimersByTime(DRAW_MS + FRAME_MS);
    expect(one).toHaveBeenCalledTimes(1);
    vi.advanceTimersByTime(250);
    expect(one).toHaveBeenCalledTimes(2);
  });
});
