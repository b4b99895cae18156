/** Replays over HTTP: open one, move its cursor, and what a whole recording tells by its index. Times are in ns. */
import { keepPreviousData, queryOptions } from "@tanstack/react-query";
import { get, Problem, send } from "./client";
import type { components } from "./generated";

type Schemas = components["schemas"];

export type ReplayDoc = Schemas["ReplayDoc"];
export type CursorLine = Schemas["CursorLine"];
export type CursorOrder = Pick<Schemas["CursorRequest"], "action"> & Partial<Schemas["CursorRequest"]>;
export type Loop = Schemas["LoopRef"];
export type Timeline = Schemas["Timeline"];
export type TimelineGap = Schemas["GapLine"];
export type EventLine = Schemas["EventLine"];
export type TimelineMark = EventLine;
export type IndexLine = Schemas["IndexLine"];
export type SignalLine = Schemas["SignalLine"];
export type SeriesLine = Schemas["SeriesLine"];
export type ChangeLine = Schemas["ChangeLine"];
export type MomentSet = Schemas["MomentSet"];
export type TripsDoc = Schemas["TripsDoc"];
export type TripDoc = Schemas["TripDoc"];
export type TripStep = Schemas["TripStepDoc"];
export type KeyEvent = Schemas["KeyEventDoc"];
export type Words = Schemas["WordsDoc"];

const INDEX_MISSING = "index_missing";
const LOOK_AGAIN_MS = 500;

const digits = (tNs: number): string => String(BigInt(Math.round(tNs)));
const base = (id: string) => `/api/replay/${encodeURIComponent(id)}`;

/** The file whose replay has this name. */
export const recordingOf = (id: string): string => `${id}.mcap`;

/** Opens the replay of this name; the one that is open where there is one, else a new one that stands at `atNs`. */
export const openReplay = (id: string, atNs: number | null = null) =>
  send<ReplayDoc>("POST", "/api/replay", {
    recording: recordingOf(id),
    at_ns: atNs === null ? null : Math.round(atNs),
  });

/** Moves the cursor for all who look; what is not said is left as it is. */
export const orderCursor = (id: string, order: CursorOrder): Promise<CursorLine> =>
  send<CursorLine>("POST", `${base(id)}/cursor`, order);

/** What rests on the index is asked for again until that is made. */
const untilIndexed = {
  retry: (failures: number, error: Error) =>
    (error instanceof Problem && error.doc.code === INDEX_MISSING && failures < 1200) ||
    (!(error instanceof Problem) && failures < 3),
  retryDelay: LOOK_AGAIN_MS,
};

export const signalsQuery = (id: string) =>
  queryOptions({
    queryKey: ["replay", id, "signals"],
    queryFn: ({ signal }) => get<SignalLine[]>(`${base(id)}/signals`, signal),
    ...untilIndexed,
  });

export const eventsQuery = (id: string) =>
  queryOptions({
    queryKey: ["replay", id, "events"],
    queryFn: ({ signal }) => get<EventLine[]>(`${base(id)}/events`, signal),
    ...untilIndexed,
  });

/** How the index stands, looked at until it is made. */
export const indexQuery = (id: string) =>
  queryOptions({
    queryKey: ["replay", id, "index"],
    queryFn: async ({ signal }) => (await get<ReplayDoc>(base(id), signal)).index,
    refetchInterval: (query) => (query.state.data?.state === "building" ? LOOK_AGAIN_MS : false),
  });

/** Load, gaps and marks of a stretch; what was told of another one stays until then. */
export const timelineQuery = (id: string, { from_ns, to_ns }: Loop, buckets: number, ready = true) =>
  queryOptions({
    queryKey: ["replay", id, "timeline", from_ns, to_ns, buckets],
    queryFn: ({ signal }) => {
      const stretch = { from_ns: digits(from_ns), to_ns: digits(to_ns), buckets: String(buckets) };
      return get<Timeline>(`${base(id)}/timeline?${new URLSearchParams(stretch)}`, signal);
    },
    enabled: ready,
    placeholderData: keepPreviousData,
    gcTime: 60_000,
    ...untilIndexed,
  });

/** Signals (`<device>/<address>`) from and to a time, or of the whole recording, in about so many points each. */
export interface SeriesWanted {
  signals: readonly string[];
  fromNs: number | null;
  toNs: number | null;
  points: number;
}

export const seriesQuery = (id: string, wanted: SeriesWanted) =>
  queryOptions({
    queryKey: ["replay", id, "series", wanted],
    queryFn: ({ signal }) => get<SeriesLine[]>(`${base(id)}/series?${seriesSearch(wanted)}`, signal),
    enabled: wanted.signals.length > 0,
    placeholderData: keepPreviousData,
    gcTime: 60_000,
    ...untilIndexed,
  });

function seriesSearch({ signals, fromNs, toNs, points }: SeriesWanted): string {
  const pairs = signals.map((name) => ["signal", name]);
  if (fromNs !== null) pairs.push(["from_ns", digits(fromNs)]);
  if (toNs !== null) pairs.push(["to_ns", digits(toNs)]);
  return new URLSearchParams([...pairs, ["points", String(points)]]).toString();
}

export const ramHistoryQuery = (id: string, device: string, address: string) =>
  queryOptions({
    queryKey: ["replay", id, "history", device, address],
    queryFn: ({ signal }) =>
      get<ChangeLine[]>(`${base(id)}/history?${new URLSearchParams({ device, address })}`, signal),
    ...untilIndexed,
  });

/** Keeps what was known at a moment as sets of the library. */
export const keepMoment = (id: string, devices: readonly string[], tNs: number, reason: string) =>
  send<MomentSet[]>("POST", `${base(id)}/sets`, { devices, t_ns: tNs, reason });

export const tripsQuery = (id: string) =>
  queryOptions({
    queryKey: ["replay", id, "trips"],
    queryFn: ({ signal }) =>
      get<TripsDoc>(`/api/recordings/${encodeURIComponent(recordingOf(id))}/trips`, signal),
    ...untilIndexed,
  });

/** The next trips, errors and warnings after a time or before it, the nearest first. */
export function keyEvents(id: string, beside: { after: number } | { before: number }): Promise<KeyEvent[]> {
  const [[side, tNs] = ["after", 0]] = Object.entries(beside);
  const search = new URLSearchParams([[side, digits(tNs)]]);
  return get<KeyEvent[]>(`/api/recordings/${encodeURIComponent(recordingOf(id))}/key-events?${search}`);
}
