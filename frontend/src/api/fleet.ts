/** One golden set against the latest set of every device of its kind. */
import { keepPreviousData, queryOptions } from "@tanstack/react-query";
import { send } from "./client";
import type { components } from "./generated";

type Schemas = components["schemas"];

export type FleetDoc = Schemas["FleetDoc"];
export type FleetDevice = Schemas["FleetDevice"];
export type FleetAddress = Schemas["FleetAddress"];
export type FleetMark = FleetDevice["marks"][number];

export const MOST_DEVICES = 5000;

/** `golden`: a record; null takes the set that is marked golden. `group`: with the marks of its parameters. */
export const fleetQuery = (kind: string, golden: string | null, group: string | null) =>
  queryOptions({
    queryKey: ["fleet", kind, golden, group],
    queryFn: () =>
      send<FleetDoc>("POST", "/api/fleet", { description_id: kind, golden, group, limit: MOST_DEVICES }),
    enabled: kind !== "",
    staleTime: 0,
    placeholderData: keepPreviousData,
  });
