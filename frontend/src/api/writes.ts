/** In which order a batch of changes would be written, by the planner of restores. */
import { keepPreviousData, queryOptions } from "@tanstack/react-query";
import type { Change } from "../model/staged";
import { send } from "./client";
import type { components } from "./generated";

type Schemas = components["schemas"];

export type WritesPlan = Schemas["WritesPlan"];

/** The order rests on what the devices hold, and that changes while it is looked at. */
const LIVE_MS = 4000;

/** Changes in the order in which they would be given; `accepted`: a person accepts rules that are broken in the end. */
export const writesPlanQuery = (changes: readonly Change[], accepted: boolean) => {
  const rows = changes.map(({ device, address, raw }) => ({ device, address, raw }));
  return queryOptions({
    queryKey: ["writes", "plan", rows, accepted],
    queryFn: () => send<WritesPlan>("POST", "/api/live/writes/plan", { rows, accepted }),
    enabled: rows.length > 0,
    staleTime: 0,
    gcTime: 30_000,
    refetchInterval: (query) => (query.state.status === "success" ? LIVE_MS : false),
    placeholderData: keepPreviousData,
  });
};
