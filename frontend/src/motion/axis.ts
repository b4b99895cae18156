/** What is known of one axis, whatever turns it: a blade, or the shaft of a drive on a bench. */
import { useQuery } from "@tanstack/react-query";
import { interlocksQuery } from "../api/motion";
import type { StationRef } from "../api/types";
import { useAxes } from "../live/live";
import type { DeviceContext } from "../model/shown";
import { objectsOf, stateKeyOf } from "../model/stateMachine";
import { quantityOf } from "../model/values";
import { entriesOf, useReading } from "../ui/reading";
import { scaledAt } from "./drive";

export interface AxisNow {
  position: number | null;
  velocity: number | null;
  /** Text key of its state. */
  state: string | null;
  stale: boolean;
  ageMs: number | null;
}

/** Where a blade is comes with the axes of the turbine; of another axis its own objects tell. */
export function useAxisNow(station: StationRef, context: DeviceContext | null): AxisNow {
  const blade = useAxes().get(station.blade ?? 0);
  const objects = objectsOf(context?.doc);
  const position = useReading(context, objects.position, "fast");
  const status = useReading(context, objects.statusword, "fast");
  useReading(context, objects.velocity ?? "", "fast");
  if (station.blade !== null)
    return {
      position: blade?.position_deg ?? null,
      velocity: blade?.velocity_dps ?? null,
      state: blade?.state ?? null,
      stale: blade?.stale ?? true,
      ageMs: null,
    };
  return {
    position: context && position ? scaledAt(context, objects.position) : null,
    velocity: context && objects.velocity !== null ? scaledAt(context, objects.velocity) : null,
    state: context && typeof status?.raw === "number" ? stateKeyOf(context.doc, status.raw) : null,
    stale: position?.stale ?? true,
    ageMs: position?.ageMs ?? null,
  };
}

export interface Measure {
  unit: string;
  decimals: number;
}

function measureAt(context: DeviceContext | null, address: string): Measure {
  const entry = context && entriesOf(context.doc).get(address);
  if (!context || !entry) return { unit: "", decimals: 2 };
  const { unit, decimals } = quantityOf(entry, context.lookup);
  return { unit, decimals };
}

/** How targets and speeds of an axis are counted, by its description and the units that it has chosen. */
export function measuresOf(context: DeviceContext | null): { position: Measure; speed: Measure } {
  const { target, speed } = objectsOf(context?.doc);
  return { position: measureAt(context, target), speed: measureAt(context, speed) };
}

const TURN: Readonly<Record<string, number>> = { "°": 360, rev: 1 };
const TURNS_PER_S: Readonly<Record<string, number>> = { "°/s": 1 / 360, "1/min": 1 / 60, "1/s": 1 };

/** How many units of position a second one unit of speed is; null where both do not go together. */
export function wayPerS(position: string, speed: string): number | null {
  if (speed === `${position}/s`) return 1;
  const turn = TURN[position];
  const turns = TURNS_PER_S[speed];
  return turn === undefined || turns === undefined ? null : turn * turns;
}

/** True where nothing stops the drive by itself when its connection is lost: then its interlocks say so. */
export function useUnwatched(device: string): boolean {
  const { data } = useQuery(interlocksQuery(device));
  return data?.some((one) => one.name === "self_stop") ?? false;
}

/** Numbers of the homing methods that the description knows; empty where it names none. */
export function homingMethods(context: DeviceContext | null): { value: number; text_key: string }[] {
  const entry = context && entriesOf(context.doc).get("6098");
  if (!context || !entry?.enumeration) return [];
  return context.doc.enumerations[entry.enumeration]?.values ?? [];
}

const HERE = 35;

/** The drive has methods by which it looks for its home; one that only takes the place where it stands has not. */
export function searches(context: DeviceContext | null): boolean {
  return homingMethods(context).some((one) => one.value !== HERE);
}
