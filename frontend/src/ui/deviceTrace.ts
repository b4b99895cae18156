/** The last minutes of an axis that turns no blade, put together of the values of its device as they come. */
import { useEffect } from "react";
import type { EntryDoc } from "../api/types";
import { useStore } from "../live/live";
import type { LiveStore } from "../live/store";
import { type Sample, Trace } from "../live/trace";
import { axisStateKey } from "../model/axisState";
import { fraction, times, toNumber } from "../model/decimal";
import type { DeviceContext } from "../model/shown";
import { quantityOf } from "../model/values";
import { entriesOf, FRESH_MS, type Pace } from "./reading";

const STATUSWORD = "6041";
const MODE = "6061";
const TARGET = "607A";
/** Profile position and cyclic synchronous position (CiA 402): only these follow the target. */
const POSITION_MODES: readonly unknown[] = [1, 8];
const FOLLOWING = "axis_state.operation_enabled";

/** The objects that are drawn, of those that the device has. */
export interface Drawn {
  position: EntryDoc | undefined;
  velocity: EntryDoc | undefined;
  /** The current, else the torque: both are shares of a rated value. */
  effort: EntryDoc | undefined;
}

export function drawnOf({ doc }: DeviceContext): Drawn {
  const entries = entriesOf(doc);
  return {
    position: entries.get("6064") ?? entries.get("5064"),
    velocity: entries.get("606C"),
    effort: entries.get("6078") ?? entries.get("6077"),
  };
}

export const traceOf = (store: LiveStore, slug: string): Trace | undefined => store.deviceTraces.get(slug);

/** Keeps the trace of the device going while the component is there; its values must be watched. */
export function useDeviceTrace(context: DeviceContext | null): void {
  const store = useStore();
  useEffect(() => {
    if (!context) return;
    return store.subscribe(`device:${context.slug}`, () => {
      push(store, context);
    });
  }, [context, store]);
}

function push(store: LiveStore, context: DeviceContext): void {
  const found = sampleOf(store, context);
  if (!found) return;
  const trace = store.deviceTraces.get(context.slug) ?? new Trace();
  store.deviceTraces.set(context.slug, trace);
  trace.push(found.timeS, found.sample);
}

/** What is known now, at the time of the latest position; null while there is none. */
export function sampleOf(store: LiveStore, context: DeviceContext): { timeS: number; sample: Sample } | null {
  const drawn = drawnOf(context);
  const at = drawn.position && store.cell(context.slug, drawn.position.address);
  if (!at?.known || at.t_ns === null) return null;
  const number = (entry: EntryDoc | undefined, pace: Pace) => numberAt(store, context, entry, pace);
  const follows =
    axisStateKey(number(entriesOf(context.doc).get(STATUSWORD), "fast") ?? Number.NaN) === FOLLOWING &&
    POSITION_MODES.includes(number(entriesOf(context.doc).get(MODE), "slow"));
  return {
    timeS: at.t_ns / 1e9,
    sample: {
      positionDeg: number(drawn.position, "fast"),
      demandDeg: follows ? number(entriesOf(context.doc).get(TARGET), "slow") : null,
      velocityDps: number(drawn.velocity, "fast"),
      currentPct: number(drawn.effort, "slow"),
    },
  };
}

/** In the unit of the object; null where it is not known, or too old for what is drawn now. */
function numberAt(
  store: LiveStore,
  { slug, lookup }: DeviceContext,
  entry: EntryDoc | undefined,
  pace: Pace,
): number | null {
  const cell = entry && store.cell(slug, entry.address);
  if (!entry || !cell?.known || cell.stale || cell.t_ns === null || typeof cell.raw !== "number") return null;
  if (store.serverNowMs() - cell.t_ns / 1e6 > FRESH_MS[pace]) return null;
  const exact = fraction(String(cell.raw));
  return exact === null ? null : toNumber(times(exact, quantityOf(entry, lookup).scale));
}
