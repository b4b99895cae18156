/** The guided steps, and how each is seen to be done. Pure: what is known of the bench in, ticks out. */
import type { LinkData, NodeData, RecordingStatus, SetRecord, Turbine } from "../../api/types";
import type { Cell } from "../../live/store";
import { placesOf } from "../../ui/devices";
import { Heard, heartbeatOf } from "../overview/nodes";
import { isUnsaved } from "../parameters/cellValue";
import type { DescriptionDoc } from "../../api/types";

export enum Tick {
  Done = "done",
  Open = "open",
  /** Not to be told from here: nothing is connected, or nothing is known yet. */
  Unknown = "unknown",
}

export interface Facts {
  hearing: boolean;
  link: LinkData | null;
  turbine: Turbine | undefined;
  nodes: ReadonlyMap<string, NodeData>;
  cellsOf: (device: string) => ReadonlyMap<string, Cell> | undefined;
  docs: ReadonlyMap<string, DescriptionDoc>;
  sets: readonly SetRecord[] | undefined;
  nowMs: number;
}

export interface Step {
  key: string;
  to: "/" | "/bus" | "/parameters" | "/sets" | "/recordings" | "/settings";
  check: (facts: Facts) => Tick;
  /** What fills the placeholders of its text. */
  details?: (facts: Facts) => Record<string, unknown>;
}

export interface Procedure {
  id: string;
  steps: readonly Step[];
}

/** A backup is a fresh one for so long. */
export const FRESH_BACKUP_MS = 24 * 3600 * 1000;

const tick = (done: boolean): Tick => (done ? Tick.Done : Tick.Open);
const connected = ({ hearing, link }: Facts) => hearing && link?.state === "connected";
const whenConnected = (check: (facts: Facts) => boolean) => (facts: Facts) =>
  connected(facts) ? tick(check(facts)) : Tick.Unknown;

const devicesOf = ({ turbine }: Facts) => placesOf(turbine).map((place) => place.device);
const recordingOf = ({ link }: Facts): RecordingStatus | null => link?.recording ?? null;

function heardOf(facts: Facts): number {
  return devicesOf(facts).filter((device) => {
    return heartbeatOf(facts.nodes.get(device.slug), facts.nowMs).heard === Heard.Alive;
  }).length;
}

/** Devices of which every readable object that would be saved is known. */
function readOf(facts: Facts): number {
  return devicesOf(facts).filter((device) => {
    const doc = facts.docs.get(device.description_id);
    const cells = facts.cellsOf(device.slug);
    return doc?.entries
      .filter((entry) => entry.readable && entry.saved)
      .every((entry) => cells?.get(entry.address)?.known === true);
  }).length;
}

function freshSets(facts: Facts): number {
  return devicesOf(facts).filter((device) =>
    facts.sets?.some(
      (one) =>
        one.origin.device === device.slug &&
        one.source === "backup" &&
        one.unread === 0 &&
        facts.nowMs - one.t_ns / 1e6 < FRESH_BACKUP_MS,
    ),
  ).length;
}

export interface Counts {
  unsaved: number;
  saved: number;
  proven: number;
}

/** Parameters of all devices by where they stand. */
export function countsOf(facts: Facts): Counts {
  const counts = { unsaved: 0, saved: 0, proven: 0 };
  for (const device of devicesOf(facts)) {
    const cells = facts.cellsOf(device.slug);
    for (const entry of facts.docs.get(device.description_id)?.entries ?? []) {
      const cell = cells?.get(entry.address);
      if (!entry.saved || !entry.writable || !cell) continue;
      if (isUnsaved(entry, cell)) counts.unsaved += 1;
      else if (cell.stored) counts[cell.stored.state] += 1;
    }
  }
  return counts;
}

const ofAll = (count: (facts: Facts) => number) => (facts: Facts) => ({
  count: count(facts),
  total: devicesOf(facts).length,
});
const allOf = (count: (facts: Facts) => number) =>
  whenConnected((facts) => devicesOf(facts).length > 0 && count(facts) === devicesOf(facts).length);

export const PROCEDURES: readonly Procedure[] = [
  {
    id: "first_connection",
    steps: [
      {
        key: "bus_heard",
        to: "/bus",
        check: (facts) => tick(connected(facts) && (facts.link?.frames ?? 0) > 0),
        details: ({ link }) => ({ frames: link?.frames ?? null }),
      },
      { key: "alone", to: "/bus", check: whenConnected(({ link }) => link?.other_masters.length === 0) },
      { key: "nodes_alive", to: "/bus", check: allOf(heardOf), details: ofAll(heardOf) },
      {
        key: "known_kind",
        to: "/",
        check: whenConnected(({ link }) => link?.mode !== "none"),
        details: ({ link }) => ({ mode_key: `page.mode.${link?.mode ?? "none"}` }),
      },
      {
        key: "recording",
        to: "/recordings",
        check: whenConnected((facts) => recordingOf(facts)?.state === "on" && recordingOf(facts)?.lost === 0),
        details: (facts) => ({ lost: recordingOf(facts)?.lost ?? null }),
      },
      { key: "as_found", to: "/parameters", check: allOf(readOf), details: ofAll(readOf) },
    ],
  },
  {
    id: "back_up",
    steps: [
      { key: "nodes_alive", to: "/bus", check: allOf(heardOf), details: ofAll(heardOf) },
      {
        key: "nothing_unsaved",
        to: "/parameters",
        check: (facts) => {
          // As long as nothing was written there is nothing to tick.
          const { unsaved, saved, proven } = countsOf(facts);
          if (!connected(facts) || unsaved + saved + proven === 0) return Tick.Unknown;
          return tick(unsaved === 0);
        },
        details: (facts) => ({ count: countsOf(facts).unsaved }),
      },
      {
        key: "sets_fresh",
        to: "/sets",
        check: (facts) => (facts.sets ? allOf(freshSets)(facts) : Tick.Unknown),
        details: ofAll(freshSets),
      },
    ],
  },
  {
    id: "change",
    steps: [
      {
        key: "sets_fresh",
        to: "/sets",
        check: (facts) => (facts.sets ? allOf(freshSets)(facts) : Tick.Unknown),
        details: ofAll(freshSets),
      },
      {
        key: "recording",
        to: "/recordings",
        check: whenConnected((facts) => recordingOf(facts)?.state === "on" && recordingOf(facts)?.lost === 0),
        details: (facts) => ({ lost: recordingOf(facts)?.lost ?? null }),
      },
      {
        key: "written_and_saved",
        to: "/parameters",
        check: (facts) => {
          // As long as nothing was written there is nothing to tick.
          const { unsaved, saved, proven } = countsOf(facts);
          if (!connected(facts) || unsaved + saved + proven === 0) return Tick.Unknown;
          return tick(unsaved === 0);
        },
        details: (facts) => ({ count: countsOf(facts).unsaved }),
      },
      {
        key: "proven",
        to: "/parameters",
        check: (facts) => {
          const { unsaved, saved, proven } = countsOf(facts);
          if (!connected(facts) || unsaved + saved + proven === 0) return Tick.Unknown;
          return tick(unsaved === 0 && saved === 0);
        },
        details: (facts) => ({ count: countsOf(facts).saved }),
      },
    ],
  },
];
