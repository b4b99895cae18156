/** The order of the DC-link voltages (manual 4.2.2, table 19): its steps, and how far each may be moved. */
import type { RuleDoc } from "../../../../api/rules";
import { PMC, PMM } from "../../../overview/layout";
import { between, type Bounds, type Neighbour, within } from "../common/bounds";

export interface Step {
  on: "pmm" | "pmc";
  address: string;
}

const RULE = "oat.dc_link_ladder";
/** Count and nominal voltage (mV) of the battery's blocs. */
export const BLOCS = "3020:04";
export const BLOC_MV = "3020:05";

/** From the bottom to the top, as the server's rule lists them: the PMC's least, those of the PMM, the PMC's greatest. */
export function stepsOf(rules: readonly RuleDoc[]): Step[] {
  const objects = rules.find((one) => one.id === RULE)?.objects;
  const [least, greatest] = objects?.[PMC] ?? [];
  const pmm = objects?.[PMM] ?? [];
  if (least === undefined || greatest === undefined || pmm.length === 0) return [];
  return [
    { on: "pmc", address: least },
    ...pmm.map((address): Step => ({ on: "pmm", address })),
    { on: "pmc", address: greatest },
  ];
}

export type Look = (step: Step) => number | null;

/** Each lies below the next known one; only the two maxima may be equal, as they are by default. */
export function stepBounds(
  steps: readonly Step[],
  at: number,
  look: Look,
  name: (step: Step) => string,
): Bounds {
  const known = (one: Step) => look(one) !== null;
  const below = steps.slice(0, at).findLast(known);
  const above = steps.slice(at + 1).find(known);
  const top = steps.length - 1;
  const gapTo = (upper: number) => (upper === top ? 0 : 1);
  const neighbour = (step: Step | undefined, upper: number): Neighbour | null =>
    step === undefined ? null : { raw: look(step), name: name(step), gap: gapTo(upper) };
  return between(neighbour(below, at), neighbour(above, above === undefined ? at : steps.indexOf(above)));
}

/** The PMC's least voltage stays below what the battery gives, in V. */
export function belowBattery(bounds: Bounds, batteryV: number | null, name: string): Bounds {
  if (batteryV === null) return bounds;
  return within(bounds, { low: null, high: { raw: Math.ceil(batteryV) - 1, other: name } });
}

/** The steps between which a voltage lies: the last one that it has reached, and the next one. */
export function zoneOf(
  steps: readonly Step[],
  voltage: number,
  look: Look,
): { below: Step | null; above: Step | null } {
  const reached = steps.filter((one) => (look(one) ?? Infinity) <= voltage);
  const ahead = steps.filter((one) => (look(one) ?? -Infinity) > voltage);
  return { below: reached.at(-1) ?? null, above: ahead[0] ?? null };
}
