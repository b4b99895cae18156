import type { AxisData } from "../api/types";

const STANDS_STILL_DPS = 0.05;
const AT_REST = [
  "not_ready_to_switch_on",
  "switch_on_disabled",
  "ready_to_switch_on",
  "switched_on",
  "fault",
];

/** True unless every axis is known to be without power and at rest: what is unknown may move. */
export function mayMove(axes: Iterable<AxisData>): boolean {
  for (const axis of axes) {
    if (axis.state === null || !AT_REST.some((name) => axis.state?.split(".").at(-1) === name)) return true;
    if (Math.abs(axis.velocity_dps ?? 0) > STANDS_STILL_DPS) return true;
  }
  return false;
}
