import type { AxisData } from "../api/types";

const STANDS_STILL_DPS = 0.05;
const AT_REST = [
  "not_ready_to_switch_on",
  "switch_on_disabled",
  "ready_to_switch_on",
  "switched_on",
  "fault",
];

/** Name of the CiA 402 state: the last part of its text key. */
const stateOf = (axis: AxisData): string | undefined => axis.state?.split(".").at(-1);

/** True unless every axis is known to be without power and at rest: what is unknown, or was known once, may move. */
export function mayMove(axes: Iterable<AxisData>): boolean {
  for (const axis of axes) {
    if (axis.stale) return true;
    if (!AT_REST.includes(stateOf(axis) ?? "")) return true;
    if (Math.abs(axis.velocity_dps ?? 0) > STANDS_STILL_DPS) return true;
  }
  return false;
}

/** True where the demand is in force: in any other state it is only a number in an object. */
export function followsDemand(axis: AxisData): boolean {
  return stateOf(axis) === "operation_enabled";
}
