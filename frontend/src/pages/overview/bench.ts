/** What the card of a station without a blade shows: objects that its devices have, whichever devices they are. */
import type { DescriptionDoc, EntryDoc } from "../../api/types";
import type { Pace } from "../../ui/reading";
import { entriesOf } from "../../ui/reading";

export interface Line {
  address: string;
  pace: Pace;
}

export const STATUSWORD = "6041";
export const ERROR_CODE = "603F";
/** Where an axis stands, in the order in which one is taken (CiA 402, and its mirror for a second axis). */
const POSITION = ["6064", "5064"] as const;

/** What is measured, in the order of the card. Each has the name that its description gives it. */
const MEASURED: readonly Line[] = [
  { address: "6061", pace: "slow" },
  { address: "606C", pace: "fast" },
  { address: "60F4", pace: "slow" },
  { address: "6078", pace: "slow" },
  { address: "6077", pace: "slow" },
  { address: "6079", pace: "slow" },
  { address: "4014:01", pace: "slow" },
  { address: "4014:03", pace: "slow" },
  { address: "4014:04", pace: "slow" },
  { address: "6410:09", pace: "slow" },
  { address: "6510:03", pace: "slow" },
  { address: "3080", pace: "slow" },
  { address: "3060", pace: "fast" },
  { address: "3063", pace: "slow" },
  { address: "3010", pace: "slow" },
];
/** Stands in for the current on a drive that gives none. */
const TORQUE = "6077";
const CURRENT = "6078";

export function measuredOf(doc: DescriptionDoc): { entry: EntryDoc; pace: Pace }[] {
  const entries = entriesOf(doc);
  return MEASURED.flatMap(({ address, pace }) => {
    const entry = entries.get(address);
    if (!entry || (address === TORQUE && entries.has(CURRENT))) return [];
    return [{ entry, pace }];
  });
}

/** The object that tells where an axis stands; null for a device without an axis. */
export function positionOf(doc: DescriptionDoc): string | null {
  return POSITION.find((address) => entriesOf(doc).has(address)) ?? null;
}
