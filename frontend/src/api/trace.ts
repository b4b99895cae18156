/** The trace: its types under the names that the page uses, and how pages and tables are fetched. */
import { keepPreviousData, useQuery } from "@tanstack/react-query";
import { baseOf } from "../live/channel";
import { useShown, useStanding } from "../live/live";
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
  ctx: string,
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
  return get<TracePage>(`${baseOf(ctx)}/frames?${asked.toString()}`, signal);
}

const FAST_MS = 500;
const SLOW_MS = 1000;

interface Table {
  name: string;
  path: string;
  everyMs: number;
}

const NODES: Table = { name: "nodes", path: "bus/nodes", everyMs: SLOW_MS };
const IDENTIFIERS: Table = { name: "ids", path: "bus/identifiers", everyMs: FAST_MS };
const LOAD: Table = { name: "load", path: "bus/load", everyMs: SLOW_MS };
const EMERGENCIES: Table = { name: "emcy", path: "bus/emergencies", everyMs: SLOW_MS };
const transfers = (which: string): Table => ({
  name: "sdo",
  path: `bus/transfers?which=${which}&limit=1000`,
  everyMs: SLOW_MS,
});

/** A table of what is shown, asked for again and again; of a recording that stands still only where it has moved. */
function useTable<T>({ name, path, everyMs }: Table) {
  const { ctx } = useShown();
  const standing = useStanding();
  return useQuery({
    queryKey: ["bus", ctx, name, path, standing],
    queryFn: ({ signal }) => get<T>(`${baseOf(ctx)}/${path}`, signal),
    refetchInterval: standing === null ? everyMs : false,
    placeholderData: keepPreviousData,
    staleTime: 0,
    ...(standing === null ? {} : { gcTime: 0 }),
    retry: false,
  });
}

export const useBusNodes = () => useTable<BusNode[]>(NODES).data ?? [];
export const useIdentifiers = () => useTable<BusIdentifier[]>(IDENTIFIERS).data ?? [];
export const useBusLoad = () => useTable<BusLoadLine[]>(LOAD).data ?? [];
export const useEmergencies = () => useTable<EmcyLine[]>(EMERGENCIES).data ?? [];
export const useTransfers = (which: string) => useTable<SdoLine[]>(transfers(which));
