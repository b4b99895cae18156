import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { every } from "./clock";

describe("the time", () => {
  beforeEach(() => {
    vi.useFakeTimers();
  });
  afterEach(() => {
    vi.useRealTimers();
  });

  it("is looked at by all with one timer, until the last of them has gone", () => {
    const [one, other, slow] = [vi.fn(), vi.fn(), vi.fn()];
    const ends = [every(1000, one), every(1000, other), every(5000, slow)];
    expect(vi.getTimerCount()).toBe(2);
    vi.advanceTimersByTime(2000);
    expect([one, other, slow].map((each) => each.mock.calls.length)).toEqual([2, 2, 0]);
    ends[0]?.();
    vi.advanceTimersByTime(1000);
    expect([one, other].map((each) => each.mock.calls.length)).toEqual([2, 3]);
    ends[1]?.();
    ends[2]?.();
    expect(vi.getTimerCount()).toBe(0);
  });

  it("goes on for the others where one ends in the midst, and begins anew after all have", () => {
    const other = vi.fn();
    const end = every(1000, () => end());
    const endOther = every(1000, other);
    vi.advanceTimersByTime(2000);
    expect(other).toHaveBeenCalledTimes(2);
    endOther();
    endOther();
    const again = vi.fn();
    const endAgain = every(1000, again);
    endOther();
    vi.advanceTimersByTime(1000);
    expect(again).toHaveBeenCalledTimes(1);
    endAgain();
  });
});
