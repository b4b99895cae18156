import { describe, expect, it } from "vitest";
import type { DescriptionDoc, EntryDoc, ServerMessage } from "../api/types";
import { LiveStore } from "../live/store";
import type { DeviceContext } from "../model/shown";
import { drawnOf, sampleOf } from "./deviceTrace";
import { rawAt } from "./reading";

const SERVO = "bench-pd4e/bench/servo";
const SECOND_NS = 1e9;

const entry = (address: string, scale: number, unit: string) =>
  ({ address, scale, unit, decimals: 1, unit_from: null }) as unknown as EntryDoc;

const DOC = {
  entries: [
    entry("6041", 1, ""),
    entry("6061", 1, ""),
    entry("6064", 0.1, "°"),
    entry("607A", 0.1, "°"),
    entry("606C", 1, "rpm"),
    entry("6077", 0.1, "%"),
  ],
} as unknown as DescriptionDoc;

function bench(values: Record<string, number>, tNs = 100 * SECOND_NS, nowNs = tNs) {
  const store = new LiveStore(
    (flush) => {
      flush();
    },
    () => nowNs / 1e6,
  );
  const cells = Object.entries(values).map(([address, raw]) => [
    address,
    { raw, hex: "", t_ns: tNs, source: "poll", stored: null, known: true, stale: false },
  ]);
  const data = { device: SERVO, full: true, values: Object.fromEntries(cells) as unknown };
  store.apply({ v: 1, ctx: "live", type: "values", seq: 1, t_ns: nowNs, data } as unknown as ServerMessage);
  const context = { slug: SERVO, doc: DOC, lookup: (at: string) => rawAt(store, SERVO, at) };
  return { store, context: context as unknown as DeviceContext };
}

const MOVING = { "6041": 0x237, "6061": 1, "6064": 7200, "607A": 3600, "606C": 120, "6077": 55 };

describe("the trace of an axis without a blade", () => {
  it("takes what its device has, in its units", () => {
    const { store, context } = bench(MOVING);
    expect(drawnOf(context).effort?.address).toBe("6077");
    expect(sampleOf(store, context)).toEqual({
      timeS: 100,
      sample: { positionDeg: 720, demandDeg: 360, velocityDps: 120, currentPct: 5.5 },
    });
  });

  it("has no demand while nothing follows it", () => {
    for (const other of [{ "6041": 0x231 }, { "6061": 3 }, { "6061": 6 }]) {
      const { store, context } = bench({ ...MOVING, ...other });
      expect(sampleOf(store, context)?.sample.demandDeg).toBeNull();
    }
  });

  it("has a gap for what is too old, and nothing before a position is known", () => {
    const { store, context } = bench(MOVING, 100 * SECOND_NS, 103 * SECOND_NS);
    const sample = sampleOf(store, context)?.sample;
    expect(sample).toEqual({ positionDeg: null, demandDeg: null, velocityDps: null, currentPct: 5.5 });
    const empty = bench({ "6041": 0x237 });
    expect(sampleOf(empty.store, empty.context)).toBeNull();
  });
});
