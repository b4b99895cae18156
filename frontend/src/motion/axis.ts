/** What is known of one axis, whatever turns it: a blade, or the shaft of a drive on a bench. */
import { useQuery } from "@tanstack/react-query";
import { interlocksQuery } from "../api/motion";
import type { StationRef } from "../api/types";
import { useDerived, useHearing } from "../live/live";
import type { LiveStore } from "../live/store";
import type { DeviceContext } from "../model/shown";
import { objectsOf, stateKeyOf } from "../model/stateMachine";
import { quantityOf } from "../model/values";
import { entriesOf, readingIn, readingTopics } from "../ui/reading";
import { scaledAt } from "./drive";

const REFRESH_MS = 1000;

export interface AxisNow {
  position: number | null;
  velocity: number | null;
  /** Text key of its state. */
  state: string | null;
  stale: boolean;
  /** Only while it is stale. */
  ageMs: number | null;
}

/**
 * Where a blade is comes with the axes of the turbine; of another axis its own objects tell. What a component picks of it
 * decides when it is rendered anew.
 */
export function useAxisNow<T>(
  station: StationRef,
  context: DeviceContext | null,
  pick: (now: AxisNow) => T,
): T {
  const deaf = useHearing().state !== "hearing";
  const { blade } = station;
  const { position, statusword, velocity } = objectsOf(context?.doc);
  const topics =
    blade === null ? readingTopics(context, position, statusword, velocity ?? position) : ["axes"];
  return useDerived(
    topics,
    (store) => pick(axisNowIn(store, station, context, deaf)),
    blade === null ? { everyMs: REFRESH_MS } : {},
  );
}

/** The same as it is known at this moment. */
export function axisNowIn(
  store: LiveStore,
  { blade }: StationRef,
  context: DeviceContext | null,
  deaf: boolean,
): AxisNow {
  return blade === null ? ofDevice(store, context, deaf) : ofBlade(store, blade);
}

function ofBlade(store: LiveStore, blade: number): AxisNow {
  const axis = store.axes.get(blade);
  return {
    position: axis?.position_deg ?? null,
    velocity: axis?.velocity_dps ?? null,
    state: axis?.state ?? null,
    stale: axis?.stale ?? true,
    ageMs: null,
  };
}

function ofDevice(store: LiveStore, context: DeviceContext | null, deaf: boolean): AxisNow {
  const objects = objectsOf(context?.doc);
  const position = context && readingIn(store, context, objects.position, "fast", deaf);
  const status = context?.lookup(objects.statusword);
  const stale = position?.stale ?? true;
  return {
    position: context && position ? scaledAt(context, objects.position) : null,
    velocity: context && objects.velocity !== null ? scaledAt(context, objects.velocity) : null,
    state: context && typeof status === "number" ? stateKeyOf(context.doc, status) : null,
    stale,
    ageMs: stale ? (position?.ageMs ?? null) : null,
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
