import { describe, expect, it } from "vitest";
import type { AxisData } from "../api/types";
import { followsDemand, mayMove } from "./axis";

const axis = (state: string | null, velocity: number | null = 0) =>
  ({ state, velocity_dps: velocity }) as AxisData;

describe("what may move", () => {
  it("is every axis with power", () => {
    expect(mayMove([axis("cia402.switched_on"), axis("cia402.operation_enabled")])).toBe(true);
    expect(mayMove([axis("cia402.quick_stop_active")])).toBe(true);
    expect(mayMove([axis("cia402.fault_reaction_active")])).toBe(true);
  });

  it("is every axis of which nothing is known", () => {
    expect(mayMove([axis("cia402.switched_on"), axis(null)])).toBe(true);
  });

  it("is every axis that turns, whatever it says", () => {
    expect(mayMove([axis("cia402.switched_on", -0.2)])).toBe(true);
  });

  it("is no axis at rest without power", () => {
    const rest = [
      "not_ready_to_switch_on",
      "switch_on_disabled",
      "ready_to_switch_on",
      "switched_on",
      "fault",
    ];
    expect(mayMove(rest.map((name) => axis(`cia402.${name}`, 0.01)))).toBe(false);
    expect(mayMove([])).toBe(false);
  });
});

describe("a demand", () => {
  it("is in force only while operation is enabled", () => {
    expect(followsDemand(axis("axis_state.operation_enabled"))).toBe(true);
    expect(followsDemand(axis("axis_state.switched_on"))).toBe(false);
    expect(followsDemand(axis(null))).toBe(false);
  });
});
