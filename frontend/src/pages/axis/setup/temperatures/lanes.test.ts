import { describe, expect, it } from "vitest";
import { held } from "../common/bounds";
import {
  addressesOf,
  controlBounds,
  type ControllerLane,
  hysteresisBounds,
  limitBounds,
  measured,
  SPOTS,
  type SupervisorLane,
} from "./lanes";

const name = (kind: string) => kind;
const laneOf = (index: string) => {
  const lane = SPOTS.flatMap((one) => one.lanes).find((one) => one.index === index);
  if (!lane) throw new Error(index);
  return lane;
};
const BATTERY = laneOf("3110") as SupervisorLane;
const CONTROLLER = laneOf("3201") as ControllerLane;
const FAN = laneOf("3204") as ControllerLane;
const LIMITS: Record<string, number> = { "3110:03": 0, "3110:01": 500, "3110:02": 550 };
const BANDS: Record<string, number> = { "3201:01": 0, "3201:02": 450, "3201:03": 50 };
const look = (values: Record<string, number>) => (address: string) => values[address] ?? null;

describe("lanes of temperatures", () => {
  it("has all four supervisors and all four controllers, those of one sensor together", () => {
    const found = SPOTS.map((one) => [one.spot.key, ...one.lanes.map((lane) => lane.index)]);
    expect(found).toEqual([
      ["battery", "3110", "3201"],
      ["sensor_1", "3112", "3202"],
      ["sensor_2", "3113", "3203"],
      ["motor", "6410", "3204"],
      ["heat_sink_pmm", "3111"],
      ["heat_sink_pmc", "6510"],
    ]);
    expect(addressesOf("pmm")).toHaveLength(4 * 4 + 3 * 7 + 3);
    expect(addressesOf("pmc")).toEqual(["6410:08", "6410:07", "6510:06", "6510:02"]);
  });

  it("keeps lower limit below warning below error", () => {
    const warning = limitBounds(BATTERY, "3110:01", look(LIMITS), name);
    expect(held(600, warning)).toEqual({ raw: 549, by: { raw: 549, other: "error" } });
    expect(held(-10, warning)).toEqual({ raw: 1, by: { raw: 1, other: "lower" } });
    expect(limitBounds(BATTERY, "3110:03", look(LIMITS), name).low).toBeNull();
    expect(limitBounds(BATTERY, "3110:02", look(LIMITS), name).high).toBeNull();
  });

  it("keeps heating with its hysteresis below cooling", () => {
    expect(held(430, controlBounds(CONTROLLER, "3201:01", look(BANDS), name)).raw).toBe(399);
    expect(held(10, controlBounds(CONTROLLER, "3201:02", look(BANDS), name))).toEqual({
      raw: 51,
      by: { raw: 51, other: "heater" },
    });
    expect(hysteresisBounds(CONTROLLER, look(BANDS), name)).toEqual({
      low: { raw: 1, other: null },
      high: { raw: 449, other: "cooler" },
    });
  });

  it("holds the motor fan by nothing, and nothing by what is not known", () => {
    expect(controlBounds(FAN, "3204:01", look({ "3204:01": 800, "3204:02": 50 }), name)).toEqual({
      low: null,
      high: null,
    });
    expect(hysteresisBounds(FAN, look({ "3204:01": 800 }), name).high).toBeNull();
    expect(controlBounds(CONTROLLER, "3201:01", look({}), name)).toEqual({ low: null, high: null });
  });

  it("takes short circuit and wire break for no measurement", () => {
    expect([231, -32768, 32767, null, "x"].map(measured)).toEqual([231, null, null, null, null]);
  });
});
