import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { whileSeen } from "./whileSeen";

const FRAME_MS = 16;
const STEP_MS = 200;

type Tell = (entries: { isIntersecting: boolean }[]) => void;
let scroll: Tell = () => undefined;
let watched = 0;

class Observer {
  constructor(tell: Tell) {
    scroll = tell;
  }
  observe(): void {
    watched += 1;
  }
  disconnect(): void {
    watched -= 1;
  }
}

describe("a plot", () => {
  beforeEach(() => {
    vi.useFakeTimers();
    watched = 0;
    vi.stubGlobal("IntersectionObserver", Observer);
    vi.stubGlobal("requestAnimationFrame", (draw: () => void) => setTimeout(draw, FRAME_MS));
    vi.stubGlobal("cancelAnimationFrame", clearTimeout);
  });
  afterEach(() => {
    vi.useRealTimers();
    vi.unstubAllGlobals();
  });

  const begin = (draw: () => void) => whileSeen({} as Element, STEP_MS, draw);

  it("is drawn with the next frame once it comes into view, and again and again", () => {
    const draw = vi.fn();
    begin(draw);
    vi.advanceTimersByTime(1000);
    expect(draw).not.toHaveBeenCalled();
    scroll([{ isIntersecting: true }]);
    expect(draw).not.toHaveBeenCalled();
    vi.advanceTimersByTime(FRAME_MS);
    expect(draw).toHaveBeenCalledTimes(1);
    vi.advanceTimersByTime(5 * STEP_MS);
    expect(draw).toHaveBeenCalledTimes(6);
  });

  it("is not drawn any more out of view, and asks for one frame at a time", () => {
    const draw = vi.fn();
    begin(draw);
    scroll([{ isIntersecting: true }]);
    scroll([{ isIntersecting: true }, { isIntersecting: false }]);
    vi.advanceTimersByTime(1000);
    expect(draw).not.toHaveBeenCalled();

    vi.stubGlobal("requestAnimationFrame", (later: () => void) => setTimeout(later, 3 * STEP_MS));
    scroll([{ isIntersecting: true }]);
    vi.advanceTimersByTime(3 * STEP_MS);
    expect(draw).toHaveBeenCalledTimes(1);
    expect(vi.getTimerCount()).toBeLessThanOrEqual(2);
  });

  it("leaves nothing behind", () => {
    const draw = vi.fn();
    const end = begin(draw);
    scroll([{ isIntersecting: true }]);
    expect(watched).toBe(1);
    end();
    vi.advanceTimersByTime(1000);
    expect(draw).not.toHaveBeenCalled();
    expect([watched, vi.getTimerCount()]).toEqual([0, 0]);
  });
});
