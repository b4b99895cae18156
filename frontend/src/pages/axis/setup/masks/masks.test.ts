import { describe, expect, it } from "vitest";
import type { RuleDoc, RuleFinding } from "../../../../api/rules";
import type { BitDoc } from "../../../../api/types";
import { alarmOf, bitsOf, clampsOf, isActive, maskOf } from "./alarm";
import { angleAt, arcPath, pointAt } from "./arc";
import { columnsOf, conflictOf, groupsOf, hasBit, outputsOf, stepIn, toggled } from "./matrix";

const bit = (at: number, name: string, clamp: string | null): BitDoc => ({
  bit: at,
  last: at,
  name,
  text_key: name,
  clamp,
  error_code: null,
});
const TABLE = [
  bit(0, "efc", "X13.10"),
  bit(4, "x13_6", "X13.6"),
  bit(9, "lightning_protection", "X14.11"),
  bit(14, "is_fault", null),
  bit(15, "high_active", null),
];
const BITS = bitsOf(TABLE);
if (!BITS) throw new Error("no bits");

describe("alarm inputs", () => {
  it("makes 4200h of X14.11, low-active, fault: the example of the manual", () => {
    const alarm = { inputs: [9], fault: true, highActive: false };
    expect(maskOf(alarm, BITS)).toBe(0x4200);
    expect(alarmOf(0x4200, BITS)).toEqual(alarm);
    expect(clampsOf(alarm, BITS)).toEqual(["X14.11"]);
  });

  it("reads every mask back that it makes, and is 0000h without an input", () => {
    for (const fault of [false, true])
      for (const highActive of [false, true])
        for (const inputs of [[0], [4], [0, 9]]) {
          const alarm = { inputs, fault, highActive };
          expect(alarmOf(maskOf(alarm, BITS), BITS)).toEqual(alarm);
        }
    expect(maskOf({ inputs: [], fault: true, highActive: true }, BITS)).toBe(0);
    expect(bitsOf(TABLE.slice(0, 4))).toBeNull();
  });

  it("tells whether it is raised now, and does not guess", () => {
    const low = { inputs: [9], fault: true, highActive: false };
    expect([isActive(low, 0x0200), isActive(low, 0), isActive(low, null)]).toEqual([false, true, null]);
    expect(isActive({ ...low, highActive: true }, 0xf000_0200)).toBe(true);
    expect(isActive({ ...low, inputs: [0, 9] }, 0)).toBeNull();
    expect(isActive({ ...low, inputs: [] }, 0)).toBe(false);
  });
});

const RULES: RuleDoc[] = [
  {
    id: "oat.outputs_shared",
    section: "4.7.1.4",
    severity: "warning",
    stepwise: false,
    objects: { "oat-pmm": ["3201:04", "3201:05", "3220:03"] },
  },
];
const finding = (rule: string, clamps: string): RuleFinding => ({
  rule,
  severity: "warning",
  verdict: "broken",
  places: [],
  details: { clamps },
});

describe("matrix of outputs", () => {
  it("has the functions of the server's rule, then the controller, under the heads of their objects", () => {
    const columns = columnsOf(RULES);
    expect(columns).toEqual(["3201:04", "3201:05", "3220:03", "30FE:02", "30FE:01"]);
    expect(groupsOf(columns)).toEqual([
      { index: "3201", count: 2 },
      { index: "3220", count: 1 },
      { index: "30FE", count: 2 },
    ]);
    expect(columnsOf([])).toEqual([]);
    expect(outputsOf(TABLE).map((one) => one.clamp)).toEqual(["X13.10", "X13.6", "X14.11"]);
  });

  it("turns one bit over and leaves all others, the highest too", () => {
    expect(toggled(0x0040, 4)).toBe(0x0050);
    expect(toggled(0x0050, 6)).toBe(0x0010);
    expect(toggled(0xffff_0000, 0)).toBe(0xffff_0001);
    expect([hasBit(0x8000_0000, 31), hasBit(0x8000_0000, 30)]).toEqual([true, false]);
  });

  it("marks exactly the clamps that a rule names, the graver rule first", () => {
    const found = [
      finding("oat.outputs_shared", "X14.1, X14.2"),
      finding("oat.outputs_of_controller", "X14.2"),
    ];
    expect(conflictOf(found, "X14.1")?.rule).toBe("oat.outputs_shared");
    expect(conflictOf(found, "X14.2")?.rule).toBe("oat.outputs_of_controller");
    expect(conflictOf(found, "X14")).toBeNull();
    expect(conflictOf([finding("oat.fault_output", "X14.1")], "X14.1")).toBeNull();
  });

  it("goes through the grid by keys and stays inside", () => {
    expect(stepIn("ArrowUp", 0, 3, 12, 16)).toEqual([0, 3]);
    expect(stepIn("ArrowDown", 10, 3, 12, 16)).toEqual([11, 3]);
    expect(stepIn("ArrowRight", 2, 15, 12, 16)).toEqual([2, 15]);
    expect(stepIn("ArrowLeft", 2, 15, 12, 16)).toEqual([2, 14]);
    expect([stepIn("Home", 2, 9, 12, 16), stepIn("End", 2, 9, 12, 16)]).toEqual([
      [2, 0],
      [2, 15],
    ]);
    expect(stepIn("a", 2, 9, 12, 16)).toBeNull();
  });
});

describe("arc of the position range", () => {
  it("has -180° left, 0° at the top, 180° right", () => {
    for (const [angle, x, y] of [
      [-180, -100, 0],
      [0, 0, -100],
      [180, 100, 0],
    ] as const) {
      expect(pointAt(angle, 100).x).toBeCloseTo(x);
      expect(pointAt(angle, 100).y).toBeCloseTo(y);
    }
    expect(arcPath(-180, 180, 10)).toMatch(/^M -10 /);
  });

  it("finds the angle of a place again", () => {
    for (const angle of [-180, -87, 0, 12.5, 87, 179]) expect(angleAt(pointAt(angle, 60))).toBeCloseTo(angle);
    expect([angleAt({ x: -5, y: 3 }), angleAt({ x: 5, y: 3 })]).toEqual([-180, 180]);
  });
});
