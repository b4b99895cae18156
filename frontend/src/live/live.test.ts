import { beforeEach, describe, expect, it } from "vitest";
import type { AxisData, CursorData, EventData, ServerMessage, ValueData } from "../api/types";
import { Backoff } from "./backoff";
import { DeafnessTimer } from "./deafness";
import { LiveStore } from "./store";

describe("deafness", () => {
  it("comes after one second without a message, and goes with the next", () => {
    const timer = new DeafnessTimer(0);
    expect(timer.check(1000).deaf).toBe(false);
    expect(timer.check(1001)).toEqual({ deaf: true, lastHeardMs: null });
    timer.heard(1500);
    expect(timer.check(2500)).toEqual({ deaf: false, lastHeardMs: 1500 });
    expect(timer.check(2501)).toEqual({ deaf: true, lastHeardMs: 1500 });
  });
});

describe("back-off", () => {
  it("doubles up to four seconds and starts again after a reset", () => {
    const middle = new Backoff(() => 0.5);
    expect([1, 2, 3, 4, 5, 6].map(() => middle.next())).toEqual([250, 500, 1000, 2000, 4000, 4000]);
    middle.reset();
    expect(middle.next()).toBe(250);
  });

  it("spreads by a quarter either way", () => {
    expect(new Backoff(() => 0).next()).toBe(187.5);
    expect(new Backoff(() => 1).next()).toBe(312.5);
  });
});

const NOW_NS = 1_700_000_000_000_000_000;
const PMC = "wtg-07/blade-1/pmc";
let nowMs = 0;
let flushes: (() => void)[] = [];
let store: LiveStore;

const flush = () => {
  for (const one of flushes.splice(0)) one();
};

function send<T extends ServerMessage["type"]>(
  type: T,
  data: Extract<ServerMessage, { type: T }>["data"],
  tNs = NOW_NS,
) {
  store.apply({ v: 1, ctx: "live", type, seq: 1, t_ns: tNs, data } as ServerMessage);
}

const value = (hex: string, change: Partial<ValueData> = {}): ValueData => ({
  raw: parseInt(hex, 16),
  hex,
  t_ns: NOW_NS,
  source: "sdo-read",
  stored: null,
  known: true,
  stale: false,
  ...change,
});

const axis = (position: number | null, stale = false) =>
  ({ blade: 1, position_deg: position, demand_deg: 80, stale }) as AxisData;

beforeEach(() => {
  nowMs = 1000;
  flushes = [];
  store = new LiveStore(
    (flushNow) => flushes.push(flushNow),
    () => nowMs,
  );
});

describe("store", () => {
  it("tells listeners once a tick, however many messages came", () => {
    let told = 0;
    store.subscribe("axes", () => (told += 1));
    for (let message = 0; message < 50; message += 1) send("axes", [axis(message)]);
    expect(told).toBe(0);
    expect(flushes).toHaveLength(1);
    flush();
    expect(told).toBe(1);
    expect(store.axes.get(1)?.position_deg).toBe(49);
    send("axes", [axis(50)]);
    flush();
    expect(told).toBe(2);
  });

  it("tells only those whose value came", () => {
    const told: string[] = [];
    store.subscribe(`value:${PMC}/6065`, () => told.push("6065"));
    store.subscribe(`value:${PMC}/6067`, () => told.push("6067"));
    const leave = store.subscribe(`value:${PMC}/6065`, () => told.push("gone"));
    leave();
    send("values", { device: PMC, full: false, values: { "6065": value("0A") } });
    flush();
    expect(told).toEqual(["6065"]);
  });

  it("merges deltas, and replaces all with the snapshot after a new subscription", () => {
    send("values", { device: PMC, full: true, values: { "6065": value("0A"), "6067": value("0B") } });
    send("values", { device: PMC, full: false, values: { "6065": value("0C") } });
    expect(store.cell(PMC, "6067")?.hex).toBe("0B");
    send("values", { device: PMC, full: true, values: { "6065": value("0D") } });
    expect(store.cell(PMC, "6065")?.hex).toBe("0D");
    expect(store.cell(PMC, "6067")).toBeUndefined();
  });

  it("forgets what it knew of another turbine, also where a new server counts as the one before", () => {
    const bench = (turbine: string) => ({ epoch: 1, turbine, visit: null });
    send("bench", bench("wtg-07"));
    send("axes", [axis(80)]);
    send("values", { device: PMC, full: true, values: { "6065": value("0A") } });
    send("bench", bench("wtg-07"));
    expect(store.cell(PMC, "6065")?.hex).toBe("0A");
    send("bench", bench("wtg-08"));
    expect(store.axes.size).toBe(0);
    expect(store.cell(PMC, "6065")).toBeUndefined();
  });

  it("marks a change of a known value, and neither the first reading nor a re-reading", () => {
    send("values", { device: PMC, full: false, values: { "6065": value("0A") } });
    expect(store.cell(PMC, "6065")?.changedAtMs).toBeNull();
    send("values", { device: PMC, full: false, values: { "6065": value("0A") } });
    expect(store.cell(PMC, "6065")?.changedAtMs).toBeNull();
    send("values", { device: PMC, full: false, values: { "6065": value("0B") } });
    expect(store.cell(PMC, "6065")?.changedAtMs).toBe(NOW_NS / 1e6);
    send("values", { device: PMC, full: false, values: { "6065": value("0B", { known: false }) } });
    send("values", { device: PMC, full: false, values: { "6065": value("0C") } });
    expect(store.cell(PMC, "6065")?.changedAtMs).toBe(NOW_NS / 1e6);
  });

  it("follows the server's clock", () => {
    send("heartbeat", {});
    nowMs += 250;
    expect(store.serverNowMs()).toBe(NOW_NS / 1e6 + 250);
  });

  it("keeps events newest first and tells none twice after a new connection", () => {
    const event = (tNs: number) => ({
      t_ns: tNs,
      severity: "info" as const,
      device: null,
      text_key: "k",
      details: {},
      person: null,
    });
    for (const tNs of [1, 3, 2, 3, 1]) send("event", event(tNs));
    expect(store.events.map((one) => one.t_ns)).toEqual([3, 2, 1]);
    expect(new Set(store.events.map((one) => one.id)).size).toBe(3);
  });

  it("leaves a gap in the trace while the position is stale", () => {
    send("axes", [axis(80)], 1e9);
    send("axes", [axis(80, true)], 1.1e9);
    expect(store.traces.get(1)?.columns(60).positions).toEqual([80, null]);
  });
});

describe("store of a recording", () => {
  const S = 1_000_000_000;
  const cursor = (t_ns: number, speed = 1): CursorData => ({
    t_ns,
    playing: true,
    speed,
    attained: speed,
    from_ns: NOW_NS,
    to_ns: NOW_NS + 60 * S,
    loop: null,
    seeking: false,
  });
  const event = (t_ns: number): EventData => ({
    t_ns,
    severity: "info",
    device: null,
    text_key: "journal.note",
    details: {},
    person: null,
  });

  beforeEach(() => {
    store = new LiveStore(
      (flushNow) => flushes.push(flushNow),
      () => nowMs,
      true,
    );
  });

  it("goes by the time of its cursor: nothing ages while that stands still", () => {
    send("cursor", cursor(NOW_NS + 5 * S), NOW_NS + 5 * S);
    nowMs += 60_000;
    expect(store.serverNowMs()).toBe((NOW_NS + 5 * S) / 1e6);
    expect(store.cursor?.t_ns).toBe(NOW_NS + 5 * S);
  });

  it("forgets all, events too, where the cursor was set elsewhere", () => {
    send("bench", { epoch: 1, turbine: "wtg-07", visit: null });
    send("event", event(NOW_NS + 5 * S));
    send("axes", [axis(10)], NOW_NS + 5 * S);
    send("values", { device: PMC, full: true, values: { "6065": value("0A") } });
    send("bench", { epoch: 2, turbine: "wtg-07", visit: null }, NOW_NS + S);
    expect(store.events).toEqual([]);
    expect(store.axes.size).toBe(0);
    expect(store.cell(PMC, "6065")).toBeUndefined();
    send("axes", [axis(3)], NOW_NS + S);
    expect(store.traces.get(1)?.columns(60).positions).toEqual([3]);
  });

  it("breaks a trace where messages are missing, by how fast it plays", () => {
    const played = (speed: number) => {
      send("bench", { epoch: speed, turbine: "wtg-07", visit: null });
      send("cursor", cursor(NOW_NS, speed));
      send("axes", [axis(1)], NOW_NS);
      send("axes", [axis(2)], NOW_NS + 3 * S);
      return store.traces.get(1)?.columns(60).positions;
    };
    expect(played(1)).toEqual([1, null, 2]);
    expect(played(10)).toEqual([1, 2]);
  });
});
