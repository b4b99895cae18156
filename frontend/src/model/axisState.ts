/** States of an axis by its statusword (CiA 402, 6041h): the bits that count, and what they are in each state. */
interface State {
  name: string;
  mask: number;
  bits: number;
}

const FULL = 0x6f;
/** Bit 5 says nothing in states without power. */
const SHORT = 0x4f;

const STATES: readonly State[] = [
  { name: "not_ready_to_switch_on", mask: SHORT, bits: 0x00 },
  { name: "switch_on_disabled", mask: SHORT, bits: 0x40 },
  { name: "ready_to_switch_on", mask: FULL, bits: 0x21 },
  { name: "switched_on", mask: FULL, bits: 0x23 },
  { name: "operation_enabled", mask: FULL, bits: 0x27 },
  { name: "quick_stop_active", mask: FULL, bits: 0x07 },
  { name: "fault_reaction_active", mask: SHORT, bits: 0x0f },
  { name: "fault", mask: SHORT, bits: 0x08 },
];

/** Text key of the state that a statusword tells; null for bits that no state has. */
export function axisStateKey(statusword: number): string | null {
  const found = STATES.find(({ mask, bits }) => (statusword & mask) === bits);
  return found ? `axis_state.${found.name}` : null;
}

const WARNING = 1 << 7;
const FAULT = 1 << 3;

/** What a drive complains of with an error code (603Fh): only a warning where its statusword shows that and no fault. */
export function severityOf(statusword: number | null): "warning" | "error" {
  return statusword !== null && (statusword & WARNING) !== 0 && (statusword & FAULT) === 0
    ? "warning"
    : "error";
}

const FAULT_STATES = ["axis_state.fault", "axis_state.fault_reaction_active"];

/** How an axis looks whose values are known and fresh, the worst first; the 3D view goes by the same. */
export function shaftLook(
  statusword: number | null,
  errorCode: number | null,
): "fault" | "warning" | "enabled" | "idle" {
  const state = statusword === null ? null : axisStateKey(statusword);
  const complaint = errorCode === null || errorCode === 0 ? null : severityOf(statusword);
  if (complaint === "error" || (state !== null && FAULT_STATES.includes(state))) return "fault";
  if (complaint === "warning" || state === "axis_state.quick_stop_active") return "warning";
  return state === "axis_state.operation_enabled" ? "enabled" : "idle";
}
