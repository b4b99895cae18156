/** The trace: its types under the names that the page uses, and how pages and tables are fetched. */
import { queryOptions } from "@tanstack/react-query";
import { get } from "./client";
import type { components } from "./generated";

type Schemas = components["schemas"];

export type TraceLine = Schemas["TraceLine"];
export type TraceItem = Schemas["TraceItem"];
export type TraceBatch = Schemas["TraceBatch"];
export type TraceFilter = Omit<Schemas["TraceFilter"], "id" | "from_t_ns" | "to_t_ns" | "buses">;
export type TracePage = Schemas["TracePage"];
export type BusNode = Schemas["BusNode"];
export type BusIdentifier = Schemas["BusIdentifier"];
export type SdoLine = Schemas["SdoLine"];
export type EmcyLine = Schemas["EmcyLine"];
export type BusLoadLine = Schemas["BusLoadLine"];

export type Side = "before" | "after" | "around";

/** A time stamp as digits. Time stamps fit the numbers of a browser exactly; their usual text would be rounded. */
export const digitsOf = (tNs: number): string => BigInt(tNs).toString();

export function fetchFrames(
  side: Side,
  tNs: number,
  filter: TraceFilter,
  limit: number,
  signal?: AbortSignal,
): Promise<TracePage> {
  const asked = new URLSearchParams({ [side]: digitsOf(tNs), limit: String(limit) });
  for (const [name, choice] of Object.entries(filter)) {
    const text = Array.isArray(choice) ? choice.join() : String(choice ?? "");
    if (text !== "" && text !== "false") asked.set(name, text);
  }
  return get<TracePage>(`/api/live/frames?${asked.toString()}`, signal);
}

const FAST_MS = 500;
const SLOW_MS = 1000;

function table<T>(name: string, path: string, everyMs: number) {
  return queryOptions({
    queryKey: ["bus", name, path],
    queryFn: ({ signal }) => get<T>(path, signal),
    refetchInterval: everyMs,
    staleTime: 0,
    retry: false,
  });
}

export const nodesQuery = table<BusNode[]>("nodes", "/api/live/bus/nodes", SLOW_MS);
export const identifiersQuery = table<BusIdentifier[]>("ids", "/api/live/bus/identifiers", FAST_MS);
export const loadQuery = table<BusLoadLine[]>("load", "/api/live/bus/load", SLOW_MS);
export const emergenciesQuery = table<EmcyLine[]>("emcy", "/api/live/bus/emergencies", SLOW_MS);
export const transfersQuery = (which: string) =>
  table<SdoLine[]>("sdo", `/api/live/bus/transfers?which=${which}&limit=1000`, SLOW_MS);
