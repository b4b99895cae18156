/** Alarm inputs (3300h; manual 4.7.3.1, table 36): inputs by their bits, bit 14 fault or warning, bit 15 the level. */
import type { BitDoc } from "../../../../api/types";
import { hasBit } from "./matrix";

export interface Alarm {
  /** Bits of the inputs that are selected. */
  inputs: readonly number[];
  fault: boolean;
  highActive: boolean;
}

export interface AlarmBits {
  inputs: readonly BitDoc[];
  fault: number;
  highActive: number;
}

/** The parts of the mask by the description's table; null where it has not all of them. */
export function bitsOf(table: readonly BitDoc[]): AlarmBits | null {
  const fault = table.find((one) => one.name === "is_fault");
  const high = table.find((one) => one.name === "high_active");
  if (!fault || !high) return null;
  return { inputs: table.filter((one) => one.clamp !== null), fault: fault.bit, highActive: high.bit };
}

export function alarmOf(raw: number, bits: AlarmBits): Alarm {
  return {
    inputs: bits.inputs.filter((one) => hasBit(raw, one.bit)).map((one) => one.bit),
    fault: hasBit(raw, bits.fault),
    highActive: hasBit(raw, bits.highActive),
  };
}

/** Without an input there is no alarm: 0000h. */
export function maskOf({ inputs, fault, highActive }: Alarm, bits: AlarmBits): number {
  if (inputs.length === 0) return 0;
  const chosen = [...inputs, ...(fault ? [bits.fault] : []), ...(highActive ? [bits.highActive] : [])];
  return chosen.reduce((sum, bit) => sum + 2 ** bit, 0);
}

export const clampsOf = ({ inputs }: Alarm, bits: AlarmBits): string[] =>
  bits.inputs.filter((one) => inputs.includes(one.bit)).map((one) => one.clamp ?? "");

/** Whether it is raised with these inputs (30FDh). What several inputs of one mask do, the manual leaves open: null. */
export function isActive({ inputs, highActive }: Alarm, levels: number | null): boolean | null {
  const [only] = inputs;
  if (only === undefined) return false;
  return inputs.length > 1 || levels === null ? null : hasBit(levels, only) === highActive;
}
