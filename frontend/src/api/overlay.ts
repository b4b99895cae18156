/** Several recordings on one axis of time, over HTTP. Times are in ms from the zero of each. */
import { keepPreviousData, queryOptions } from "@tanstack/react-query";
import { get, send } from "./client";
import type { components } from "./generated";
import { openReplay, type ReplayDoc, type TripsDoc } from "./replay";

type Schemas = components["schemas"];

export type AlignRequest = Schemas["AlignRequest"];
export type Aligned = Schemas["AlignedDoc"];
export type AlignedTrack = Schemas["TrackDoc"];

const MANY = ["overlay"] as const;
const INDEXED_MS = 500;

export const alignQuery = (request: AlignRequest) =>
  queryOptions({
    queryKey: [...MANY, "align", request],
    queryFn: async () => (await send<Schemas["AlignDoc"]>("POST", "/api/align", request)).recordings,
    enabled: request.recordings.length > 0 && request.signals.length > 0,
    placeholderData: keepPreviousData,
    staleTime: 0,
    gcTime: 60_000,
  });

/** The trips of a recording; refused at once where it has no index yet. */
export const tripsOfQuery = (file: string) =>
  queryOptions({
    queryKey: [...MANY, "trips", file],
    queryFn: ({ signal }) => get<TripsDoc>(`/api/recordings/${encodeURIComponent(file)}/trips`, signal),
    retry: false,
    staleTime: 60_000,
  });

/** Where the cursor of a recording stands, if somebody replays it. */
export const replayedQuery = (replay: string) =>
  queryOptions({
    queryKey: ["replay", replay, "cursor"],
    queryFn: ({ signal }) => get<ReplayDoc>(`/api/replay/${encodeURIComponent(replay)}`, signal),
    retry: false,
    staleTime: 0,
  });

/** Opens the replay of a recording, which makes its index, and waits for that. */
export async function makeIndex(replay: string): Promise<ReplayDoc["index"]> {
  let doc = await openReplay(replay);
  while (doc.index.state === "building") {
    await new Promise((done) => setTimeout(done, INDEXED_MS));
    doc = await get<ReplayDoc>(`/api/replay/${encodeURIComponent(replay)}`);
  }
  return doc.index;
}

/** Of all that concerns trips and curves. */
export const overlayKeys = { queryKey: MANY };
