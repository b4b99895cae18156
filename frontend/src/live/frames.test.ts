import { beforeEach, describe, expect, it } from "vitest";
import type { TraceLine, TracePage } from "../api/trace";
import { FrameStore, MAX_ROWS } from "./frames";

let flushes: (() => void)[] = [];
let store: FrameStore;
let id = 0;
let total = 0;

const row = (tNs: number) => ({ t_ns: tNs }) as TraceLine;

/** A batch of rows at these times; all that was seen was sent, unless `leftOut`. */
function batch(times: number[], nowMs: number, leftOut = 0, startNs = 1): void {
  total += times.length + leftOut;
  const counts = { seen: total, matched: total, sent: total - leftOut, left_out: leftOut };
  store.take({ id, start_t_ns: startNs, rows: times.map(row), invalid: null, ...counts }, nowMs);
}

const times = () => store.view.rows.map((one) => one.t_ns);

const page = (rows: number[], more: Partial<TracePage> = {}) =>
  ({ rows: rows.map(row), older: true, newer: false, from_t_ns: rows[0] ?? null, ...more }) as TracePage;

beforeEach(() => {
  flushes = [];
  total = 0;
  store = new FrameStore((flush) => flushes.push(flush));
  id = store.begin(false);
});

describe("rows of the running trace", () => {
  it("come in order, at most so many, and listeners hear of them once a tick", () => {
    let told = 0;
    for (const flush of flushes.splice(0)) flush();
    store.subscribe(() => (told += 1));
    for (let at = 0; at < 60; at += 1)
      batch(
        Array.from({ length: 100 }, (_, n) => 10 + at * 100 + n),
        at * 100,
      );
    expect(flushes).toHaveLength(1);
    for (const flush of flushes.splice(0)) flush();
    expect(told).toBe(1);
    expect(store.view.rows).toHaveLength(MAX_ROWS);
    expect(times().at(-1)).toBe(10 + 5999);
  });

  it("of an earlier filter are passed over", () => {
    const before = id;
    id = store.begin(false);
    batch([5], 0);
    id = before;
    batch([6], 0);
    expect(times()).toEqual([5]);
  });

  it("stand still while paused, and what came is counted", () => {
    batch([10, 11], 0);
    store.pause();
    batch([], 100);
    batch([12, 13, 14], 200);
    expect(times()).toEqual([10, 11]);
    expect(store.view.arrived).toBe(3);
    store.resume();
    batch([15], 300);
    expect(times()).toEqual([15]);
    expect(store.view.arrived).toBe(0);
  });

  it("begin anew with another connection", () => {
    batch([10], 0);
    batch([20], 100, 0, 2);
    expect(times()).toEqual([20]);
  });

  it("join with fetched ones without a double, at both ends", () => {
    batch([10, 11], 0);
    store.merge(page([8, 9, 10]), "before");
    expect(times()).toEqual([8, 9, 10, 11]);
    store.merge(page([11, 12]), "after");
    batch([11, 12, 13], 100);
    expect(times()).toEqual([8, 9, 10, 11, 12, 13]);
    store.merge(page([1, 2]), "instead");
    expect(times()).toEqual([1, 2]);
  });
});

describe("the share of the traffic that is shown", () => {
  it("is all of it, a second", () => {
    for (let at = 0; at <= 10; at += 1) batch([10 + at], at * 100);
    expect(store.view.rates).toEqual({ seen: 10, matched: 10, shown: 10, sampled: false });
  });

  it("is a sample where rows were left out of late, and no longer once none are", () => {
    batch([10], 0);
    batch([11], 100, 700);
    expect(store.view.rates.sampled).toBe(true);
    expect(store.view.rates.matched).toBeGreaterThan(store.view.rates.shown);
  });
});
