import { describe, expect, it } from "vitest";
import type { DescriptionDoc, EntryDoc, Session } from "../api/types";
import { asks, FindingKind, type Ground, planOf, stops } from "./findings";
import { Lock, lockOf } from "./locks";
import type { Change } from "./staged";

const plain = {
  type: "INTEGER16",
  bit_count: 16,
  range: [-32768, 32767],
  access: "rw",
  readable: true,
  writable: true,
  saved: true,
  minimum: null,
  maximum: null,
  also: [],
  enumeration_from: null,
  bits_from: null,
  limits_from: null,
  step: 1,
  only: [],
  enumeration: null,
  bits: null,
  unit_from: null,
  requires: [],
  restore: "copy",
  motion: false,
};
const entry = (address: string, change: object = {}) =>
  ({ ...plain, address, ...change }) as unknown as EntryDoc;

const LOW = entry("30FB:08");
const NOMINAL = entry("30FA:01", { minimum: { address: "30FB:08", factor: 1 } });
const OFFSET = entry("607C", { requires: [{ address: "6061", values: [6] }], restore: "unit" });
const MODE = entry("6060", { requires: [{ address: "6061", values: [6], writing: [1] }] });
const HEATER = entry("3201:04", { bits: "out" });
const COOLER = entry("3202:04", { bits: "out" });
const DOC = {
  entries: [LOW, NOMINAL, OFFSET, MODE, entry("6061"), HEATER, COOLER],
  bit_tables: {
    out: [
      { bit: 0, last: 0, name: "a", text_key: "a", clamp: "X14.1", error_code: null },
      { bit: 1, last: 1, name: "b", text_key: "b", clamp: "X14.2", error_code: null },
    ],
  },
  enumerations: {},
} as unknown as DescriptionDoc;

const ground = (values: Record<string, number>, role: Session["role"] = "technician"): Ground => ({
  doc: DOC,
  entries: new Map(DOC.entries.map((one) => [one.address, one])),
  ram: (address) => values[address] ?? null,
  role,
});
const change = (address: string, raw: number, from: number | null): Change => ({
  device: "d",
  address,
  raw,
  from,
  atMs: 0,
  refused: null,
});
const kinds = (rows: ReturnType<typeof planOf>) => rows.map((row) => row.findings.map((one) => one.kind));

describe("the plan of a device", () => {
  const values = { "30FB:08": 400, "30FA:01": 450 };

  it("puts first what makes another change valid", () => {
    const rows = planOf([change("30FA:01", 380, 450), change("30FB:08", 350, 400)], ground(values));
    expect(rows.map((row) => row.change.address)).toEqual(["30FB:08", "30FA:01"]);
    expect(rows.some(stops)).toBe(false);
  });

  it("stops what fits at no turn", () => {
    const rows = planOf([change("30FA:01", 380, 450)], ground(values));
    expect(kinds(rows)).toEqual([[FindingKind.Limit]]);
    expect(rows.every(stops)).toBe(true);
  });

  it("warns of a value that a new limit leaves outside", () => {
    const rows = planOf([change("30FB:08", 460, 400)], ground(values));
    expect(kinds(rows)).toEqual([[FindingKind.Dependent]]);
    expect(rows.some(stops)).toBe(false);
  });
});

describe("findings", () => {
  it("ask where RAM holds another value than when the change was made", () => {
    const rows = planOf([change("30FB:08", 350, 400)], ground({ "30FB:08": 410 }));
    expect(kinds(rows)).toEqual([[FindingKind.Conflict]]);
    expect(rows.every(asks)).toBe(true);
  });

  it("stop where a condition is known not to hold, and warn where it is not known", () => {
    expect(kinds(planOf([change("607C", 5, 0)], ground({ "607C": 0, "6061": 1 })))).toEqual([
      [FindingKind.Precondition, FindingKind.Unit],
    ]);
    expect(kinds(planOf([change("607C", 5, 0)], ground({ "607C": 0 })))).toEqual([
      [FindingKind.UnknownPrecondition, FindingKind.Unit],
    ]);
  });

  it("ask a condition of the values only that it names", () => {
    const known = ground({ "6060": 3, "6061": 9 });
    expect(kinds(planOf([change("6060", 1, 3)], known))).toEqual([[FindingKind.Precondition]]);
    expect(kinds(planOf([change("6060", 2, 3)], known))).toEqual([[]]);
  });

  it("name a clamp that another mask uses as well, also one that is pending", () => {
    const own = change("3201:04", 3, 0);
    expect(kinds(planOf([own], ground({ "3201:04": 0, "3202:04": 2 })))).toEqual([[FindingKind.SharedClamp]]);
    const both = planOf([own, change("3202:04", 0, 2)], ground({ "3201:04": 0, "3202:04": 2 }));
    expect(kinds(both)).toEqual([[], []]);
  });
});

describe("locks", () => {
  it("hold to the role", () => {
    const factory = entry("30F1:01", { access: "r(w)", writable: false });
    expect(lockOf(factory, "technician")).toBe(Lock.Factory);
    expect(lockOf(factory, "expert")).toBeNull();
    expect(lockOf(LOW, "viewer")).toBe(Lock.Viewer);
  });

  it("bar what moves the axis, sets up PDOs, or commands", () => {
    expect(lockOf(entry("6040", { motion: true }), "expert")).toBe(Lock.Motion);
    expect(lockOf(entry("1600:01"), "expert")).toBe(Lock.Communication);
    expect(lockOf(entry("1010:03"), "expert")).toBe(Lock.Communication);
    expect(lockOf(entry("12/221"), "technician")).toBeNull();
  });
});
