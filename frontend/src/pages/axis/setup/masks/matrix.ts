/** Outputs of the PMM by the functions that may drive them (manual 4.7.1.4, table 35). */
import type { RuleDoc, RuleFinding } from "../../../../api/rules";
import type { BitDoc } from "../../../../api/types";
import { PMM } from "../../../overview/layout";

/** The mask of what the controller on the bus drives, the levels that it gives, and what is read back. */
export const CONTROLLER_MASK = "30FE:02";
export const CONTROLLER_LEVELS = "30FE:01";
export const READ_BACK = "30FE:03";

const SHARED = "oat.outputs_shared";
const OF_CONTROLLER = "oat.outputs_of_controller";

/** Masks of all functions inside the PMM, as the server's rule lists them, then those of the controller. */
export function columnsOf(rules: readonly RuleDoc[]): string[] {
  const inside = rules.find((one) => one.id === SHARED)?.objects[PMM] ?? [];
  return inside.length === 0 ? [] : [...inside, CONTROLLER_MASK, CONTROLLER_LEVELS];
}

/** Neighbouring columns of one object stand under one head. */
export function groupsOf(columns: readonly string[]): { index: string; count: number }[] {
  const groups: { index: string; count: number }[] = [];
  for (const column of columns) {
    const index = column.split(":")[0] ?? column;
    const last = groups.at(-1);
    if (last?.index === index) last.count += 1;
    else groups.push({ index, count: 1 });
  }
  return groups;
}

export const outputsOf = (table: readonly BitDoc[]): BitDoc[] => table.filter((bit) => bit.clamp !== null);

/** Whether a bit is set; without the 32-bit traps of the shift operators. */
export const hasBit = (raw: number, bit: number): boolean => Math.floor(raw / 2 ** bit) % 2 === 1;

/** The mask with the bit turned over; all other bits stay, those without a clamp included. */
export const toggled = (raw: number, bit: number): number => raw + (hasBit(raw, bit) ? -1 : 1) * 2 ** bit;

/** The finding by which a clamp may not be given to this function; null where nothing is against it. */
export function conflictOf(findings: readonly RuleFinding[], clamp: string): RuleFinding | null {
  const found = findings.filter(
    ({ rule, details }) =>
      (rule === SHARED || rule === OF_CONTROLLER) && String(details.clamps).split(", ").includes(clamp),
  );
  return found.find((one) => one.rule === OF_CONTROLLER) ?? found[0] ?? null;
}

/** Where the arrow keys lead in a grid; null where the key is none of them. */
export function stepIn(
  key: string,
  row: number,
  column: number,
  rows: number,
  columns: number,
): [number, number] | null {
  const inside = (at: number, count: number) => Math.min(count - 1, Math.max(0, at));
  switch (key) {
    case "ArrowUp":
      return [inside(row - 1, rows), column];
    case "ArrowDown":
      return [inside(row + 1, rows), column];
    case "ArrowLeft":
      return [row, inside(column - 1, columns)];
    case "ArrowRight":
      return [row, inside(column + 1, columns)];
    case "Home":
      return [row, 0];
    case "End":
      return [row, columns - 1];
    default:
      return null;
  }
}
