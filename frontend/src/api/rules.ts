/** The rules of stations, and what they say of the connected turbine once all that is pending was written. */
import { keepPreviousData, queryOptions } from "@tanstack/react-query";
import { get, send } from "./client";
import type { components } from "./generated";
import type { Raw } from "./types";

type Schemas = components["schemas"];

export type RuleDoc = Schemas["RuleDoc"];
export type RuleFinding = Schemas["RuleFinding"];
export type RuleSeverity = RuleFinding["severity"];
export type StationFindings = Schemas["StationFindings"];

/** Changes that are not written yet: raw values by address, by device. */
export type PendingValues = Record<string, Record<string, Raw>>;

/** The devices' own values change while they are looked at. */
const LIVE_MS = 4000;

export const rulesQuery = queryOptions({
  queryKey: ["rules"],
  queryFn: async ({ signal }) => (await get<Schemas["RuleList"]>("/api/rules", signal)).rules,
});

/** One station of the connected turbine, or all where it is null. What was shown stays until the next answer is there. */
export const checkQuery = (station: string | null, pending: PendingValues, enabled: boolean) =>
  queryOptions({
    queryKey: ["rules", "check", station, pending],
    queryFn: async () =>
      (await send<Schemas["RulesChecked"]>("POST", "/api/rules/check", { station, pending })).stations,
    enabled,
    staleTime: 0,
    gcTime: 30_000,
    refetchInterval: (query) => (query.state.status === "success" ? LIVE_MS : false),
    placeholderData: keepPreviousData,
  });
