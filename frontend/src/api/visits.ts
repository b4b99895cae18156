/** What changed since the last visit; asked again while the devices are still being read. */
import { queryOptions } from "@tanstack/react-query";
import { get } from "./client";
import type { components } from "./generated";

export type SinceLastVisit = components["schemas"]["ChangesSinceLastVisit"];
export type ChangedDevice = components["schemas"]["ChangedDevice"];

const READING_MS = 3000;

/** `epoch` is that of the connection: another one is another comparison. */
export const sinceLastVisitQuery = (epoch: number | undefined, connected: boolean) =>
  queryOptions({
    queryKey: ["since-last-visit", epoch],
    queryFn: ({ signal }) => get<SinceLastVisit>("/api/live/changes-since-last-visit", signal),
    enabled: connected && epoch !== undefined,
    refetchInterval: (query) => (query.state.data?.state === "reading" ? READING_MS : false),
  });
