/** What a drive holds that bounds a move (manual 5.10): the tool does not repeat the rule, it shows what will come of it. */
import type { EntryDoc, Raw } from "../api/types";
import type { DeviceContext } from "../model/shown";
import { defaultOf, quantityOf, show } from "../model/values";
import { entriesOf } from "../ui/reading";
import type { Ramps } from "./profile";

const SPEED = "6081";
const MOST_SPEED = "607F";
const MOST_MOTOR_SPEED = "6080";
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
  /** In the unit of positions; null where they are not known, or not set. */
  lowest: number | null;
  highest: number | null;
  /** The drive holds no software limits: both as delivered, and equal. */
  unlimited: boolean;
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

/** Null where it is counted in another unit than `like`: the speed of the motor is not that of a blade. */
function inUnitOf(context: DeviceContext, address: string, like: string): number | null {
  const entries = entriesOf(context.doc);
  const [one, other] = [entries.get(address), entries.get(like)];
  if (!one || !other) return null;
  const unit = (entry: EntryDoc) => quantityOf(entry, context.lookup).unit;
  return unit(one) === unit(other) ? scaledAt(context, address) : null;
}

function asDelivered(context: DeviceContext, address: string): boolean {
  const entry = entriesOf(context.doc).get(address);
  const raw = context.lookup(address);
  return entry !== undefined && raw !== null && raw === defaultOf(entry, context.node);
}

/** The lesser of both; a limit of 0 or one that is not known bounds nothing. */
const bounded = (wanted: number, most: number | null) =>
  most !== null && most > 0 ? Math.min(wanted, most) : wanted;

/** What bounds a move at `speed` by the values that are known now. */
export function boundsOf(context: DeviceContext, speed: number): Bounds {
  const at = (address: string) => scaledAt(context, address);
  const most = bounded(bounded(speed, at(MOST_SPEED)), inUnitOf(context, MOST_MOTOR_SPEED, MOST_SPEED));
  const unlimited =
    asDelivered(context, LOWEST) && asDelivered(context, HIGHEST) && at(LOWEST) === at(HIGHEST);
  const up = at(ACCELERATION) ?? NaN;
  // 6084h = 0: the acceleration counts for both (manual 5.10.2.6).
  const down = at(DECELERATION) === 0 ? up : (at(DECELERATION) ?? NaN);
  return {
    lowest: unlimited ? null : at(LOWEST),
    highest: unlimited ? null : at(HIGHEST),
    unlimited,
    ramps: {
      speedDps: most,
      accelerationDps2: bounded(up, at(MOST_ACCELERATION)),
      decelerationDps2: bounded(down, at(MOST_DECELERATION)),
    },
    bounded: most < speed ? (at(MOST_SPEED) === most ? MOST_SPEED : MOST_MOTOR_SPEED) : null,
  };
}
