/** The two encoders of an axis, and the objects that each one's scaling stands in (manual 5.5, 5.6). */
import type { EntryDoc, Raw } from "../../../../api/types";
import type { Held, Rooms, Scaling, Train } from "../../../../model/gear";
import type { DeviceContext } from "../../../../model/shown";
import { limitsOf } from "../../../../model/values";
import { entriesOf } from "../../../../ui/reading";

export interface Side {
  name: "motor" | "blade";
  resolution: readonly [string, string];
  gear: readonly [string, string];
  feed: readonly [string, string];
  polarity: string;
  position: string;
}

export const MOTOR: Side = {
  name: "motor",
  resolution: ["608F:01", "608F:02"],
  gear: ["6091:01", "6091:02"],
  feed: ["6092:01", "6092:02"],
  polarity: "607E",
  position: "6064",
};

export const BLADE: Side = {
  name: "blade",
  resolution: ["688F:01", "688F:02"],
  gear: ["6891:01", "6891:02"],
  feed: ["6892:01", "6892:02"],
  polarity: "687E",
  position: "6864",
};

export const SENSOR = "606A";
export const BLADE_ENCODER = -1;
export const VELOCITY = "607F";
export const MOTOR_SPEED = "6080";
/** Only bit 7 of a polarity counts; written are the two values that the manual names. */
export const POLARITIES = { positive: 0x00, negative: 0xc0 } as const;
const NEGATIVE = 0x80;

export const isNegative = (raw: Raw | null): boolean | null =>
  typeof raw === "number" ? (raw & NEGATIVE) !== 0 : null;

export const entryAt = (pmc: DeviceContext, address: string): EntryDoc | undefined =>
  entriesOf(pmc.doc).get(address);

export function numberAt({ lookup }: DeviceContext, address: string): number | null {
  const raw = lookup(address);
  return typeof raw === "number" ? raw : null;
}

/** What the objects of a side can hold, as their descriptions say. */
export function roomsOf(pmc: DeviceContext, side: Side): Rooms {
  const room = (address: string): bigint => {
    const entry = entryAt(pmc, address);
    return BigInt((entry && limitsOf(entry, pmc.lookup).high) ?? 0);
  };
  const pair = ([above, below]: readonly [string, string]) => ({ above: room(above), below: room(below) });
  return { resolution: pair(side.resolution), gear: pair(side.gear), feed: pair(side.feed) };
}

/** A fraction that the drive holds now; null where it is not known or no fraction. */
export function heldAt(pmc: DeviceContext, [above, below]: readonly [string, string]): Held | null {
  const [first, second] = [numberAt(pmc, above), numberAt(pmc, below)];
  if (first === null || second === null || first <= 0 || second <= 0) return null;
  return { above: BigInt(first), below: BigInt(second), reduced: false };
}

/** What the drive holds as a train: its whole gear as one stage, for the stages themselves cannot be read. */
export function trainOf(pmc: DeviceContext, side: Side): Train {
  const text = (address: string) => String(numberAt(pmc, address) ?? "");
  return {
    increments: text(side.resolution[0]),
    turns: text(side.resolution[1]),
    stages: [{ driving: text(side.gear[1]), driven: text(side.gear[0]) }],
    feed: text(side.feed[0]),
    feedTurns: text(side.feed[1]),
  };
}

/** The values of a scaling by address. */
export function rowsOf(side: Side, { resolution, gear, feed }: Scaling): [string, number][] {
  const pair = ([above, below]: readonly [string, string], held: Held): [string, number][] => [
    [above, Number(held.above)],
    [below, Number(held.below)],
  ];
  return [...pair(side.resolution, resolution), ...pair(side.gear, gear), ...pair(side.feed, feed)];
}

/** The feed whose units 607Fh is in: that of the encoder which 606Ah selects. */
export const sideInUse = (pmc: DeviceContext): Side =>
  numberAt(pmc, SENSOR) === BLADE_ENCODER ? BLADE : MOTOR;
