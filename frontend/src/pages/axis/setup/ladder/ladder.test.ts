import { describe, expect, it } from "vitest";
import type { RuleDoc } from "../../../../api/rules";
import { held } from "../common/bounds";
import { belowBattery, type Step, stepBounds, stepsOf, zoneOf } from "./ladder";

const RULES: RuleDoc[] = [
  {
    id: "oat.dc_link_ladder",
    section: "4.2.2",
    severity: "error",
    stepwise: true,
    objects: {
      "oat-pmc": ["6510:04", "6510:05"],
      "oat-pmm": ["30FA:03", "30FB:08", "30FA:01", "30FB:07", "30FC:02", "30FC:01", "30FA:02"],
    },
  },
];
const STEPS = stepsOf(RULES);
const DEFAULTS = [100, 400, 420, 560, 600, 650, 670, 750, 750];
const name = (step: Step) => step.address;
const look = (values: readonly (number | null)[]) => (step: Step) => values[STEPS.indexOf(step)] ?? null;

describe("ladder of the DC link", () => {
  it("has the steps of table 19 in their order, over both units", () => {
    expect(STEPS.map((one) => one.address)).toEqual([
      "6510:04",
      "30FA:03",
      "30FB:08",
      "30FA:01",
      "30FB:07",
      "30FC:02",
      "30FC:01",
      "30FA:02",
      "6510:05",
    ]);
    expect(stepsOf([])).toEqual([]);
  });

  it("stops every step one volt before its neighbours, and names them", () => {
    for (let at = 1; at < STEPS.length - 2; at += 1) {
      const bounds = stepBounds(STEPS, at, look(DEFAULTS), name);
      expect(held(5000, bounds)).toEqual({
        raw: (DEFAULTS[at + 1] ?? 0) - 1,
        by: { raw: (DEFAULTS[at + 1] ?? 0) - 1, other: STEPS[at + 1]?.address },
      });
      expect(held(-1, bounds).raw).toBe((DEFAULTS[at - 1] ?? 0) + 1);
    }
  });

  it("lets the two maxima be equal, but not cross", () => {
    expect(held(900, stepBounds(STEPS, 7, look(DEFAULTS), name)).raw).toBe(750);
    expect(held(700, stepBounds(STEPS, 8, look(DEFAULTS), name)).raw).toBe(750);
  });

  it("looks past a step that is not known to the next one that is", () => {
    const some = DEFAULTS.map((one, at) => (at === 4 || at === 5 ? null : one));
    expect(held(900, stepBounds(STEPS, 3, look(some), name))).toEqual({
      raw: 669,
      by: { raw: 669, other: "30FC:01" },
    });
  });

  it("keeps the least of the PMC below the battery", () => {
    const least = stepBounds(STEPS, 0, look(DEFAULTS), name);
    expect(held(300, belowBattery(least, 216, "battery"))).toEqual({
      raw: 215,
      by: { raw: 215, other: "battery" },
    });
    expect(held(300, belowBattery(least, null, "battery")).raw).toBe(300);
  });

  it("tells between which steps a voltage lies", () => {
    const zone = (voltage: number) => {
      const { below, above } = zoneOf(STEPS, voltage, look(DEFAULTS));
      return [below?.address ?? null, above?.address ?? null];
    };
    expect(zone(565)).toEqual(["30FA:01", "30FB:07"]);
    expect(zone(20)).toEqual([null, "6510:04"]);
    expect(zone(750)).toEqual(["6510:05", null]);
  });
});
