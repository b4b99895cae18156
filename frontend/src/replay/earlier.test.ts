import { describe, expect, it } from "vitest";
import type { SeriesLine } from "../api/replay";
import { Trace } from "../live/trace";
import { columnsOf } from "./earlier";

const line = (address: string, t_s: number[], low: (number | null)[], high = low): SeriesLine => ({
  device: "wtg-07/blade-1/pmc",
  address,
  unit: "",
  exact: low === high,
  bucket_s: low === high ? 0 : 1,
  t_s,
  low,
  high,
});

const ENABLED = 0x1627;
const FAULT = 0x0218;
const NOW = { positionDeg: 9, demandDeg: null, velocityDps: null, currentPct: null };

describe("what an axis did before the cursor", () => {
  it("has the values that were last told, and a demand only while it was in force", () => {
    const columns = columnsOf(
      [
        line("6064", [1, 2, 3], [10, null, 12]),
        line("607A", [0.5], [40]),
        line("6041", [0, 2.5], [ENABLED, FAULT]),
      ],
      100,
    );
    expect(columns.times).toEqual([101, 102, 103]);
    expect(columns.positions).toEqual([10, null, 12]);
    expect(columns.demands).toEqual([40, 40, null]);
    expect(columns.velocities).toEqual([null, null, null]);
  });

  it("draws least and greatest of a bucket, not something between", () => {
    const columns = columnsOf([line("6064", [0, 1], [1, 2], [5, 6])], 0);
    expect(columns.times).toEqual([0, 0.5, 1, 1.5]);
    expect(columns.positions).toEqual([1, 5, 2, 6]);
  });

  it("is put before what came since, and never among it", () => {
    const trace = new Trace();
    trace.push(102, NOW);
    trace.prepend(columnsOf([line("6064", [1, 2, 3], [10, 11, 12])], 100));
    expect(trace.columns(10).times).toEqual([101, 102]);
    expect(trace.columns(10).positions).toEqual([10, 9]);
  });
});
