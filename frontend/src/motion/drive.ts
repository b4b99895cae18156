/** What a drive holds that bounds a move (manual 5.10): the tool does not repeat the rule, it shows what will come of it. */
import type { Raw } from "../api/types";
import type { DeviceContext } from "../model/shown";
import { show } from "../model/values";
import { entriesOf } from "../ui/reading";
import type { Ramps } from "./profile";

const SPEED = "6081";
const MOST_SPEED = "607F";
const ACCELERATION = "6083";
const DECELERATION = "6084";
const MOST_ACCELERATION = "60C5";
const MOST_DECELERATION = "60C6";
const LOWEST = "607D:01";
const HIGHEST = "607D:02";

export const BOUNDS = [
  SPEED,
  MOST_SPEED,
  ACCELERATION,
  DECELERATION,
  MOST_ACCELERATION,
  MOST_DECELERATION,
  LOWEST,
  HIGHEST,
];

export interface Bounds {
  lowestDeg: number | null;
  highestDeg: number | null;
  ramps: Ramps;
  /** The object that bounds the speed below what was asked for; null where none does. */
  bounded: string | null;
}

/** What an object holds in its unit; null where that is not known. */
export function scaledAt(context: DeviceContext, address: string): number | null {
  const entry = entriesOf(context.doc).get(address);
  const raw: Raw | null = context.lookup(address);
  if (!entry || typeof raw !== "number") return null;
  const found = Number(show(entry, raw, context.lookup, "en"));
  return Number.isNaN(found) ? null : found;
}

/** The lesser of both; a limit of 0 or one that is not known bounds nothing. */
const bounded = (wanted: number, most: number | null) =>
  most !== null && most > 0 ? Math.min(wanted, most) : wanted;

/** What bounds a move at `speedDps` by the values that are known now. */
export function boundsOf(context: DeviceContext, speedDps: number): Bounds {
  const at = (address: string) => scaledAt(context, address);
  const most = bounded(speedDps, at(MOST_SPEED));
  const up = at(ACCELERATION) ?? NaN;
  // 6084h = 0: the acceleration counts for both (manual 5.10.2.6).
  const down = at(DECELERATION) === 0 ? up : (at(DECELERATION) ?? NaN);
  return {
    lowestDeg: at(LOWEST),
    highestDeg: at(HIGHEST),
    ramps: {
      speedDps: most,
      accelerationDps2: bounded(up, at(MOST_ACCELERATION)),
      decelerationDps2: bounded(down, at(MOST_DECELERATION)),
    },
    bounded: most < speedDps ? MOST_SPEED : null,
  };
}
