/** The battery of an axis: conditions and course of its test, its change, and what was kept of both. */
import { queryOptions } from "@tanstack/react-query";
import { get, send } from "./client";
import type { components } from "./generated";

type Schemas = components["schemas"];

export type Battery = Schemas["BatteryDoc"];
export type Need = Schemas["NeedDoc"];
export type RunningTest = Schemas["RunningTestDoc"];
export type TestRecord = Schemas["TestRecord"];
export type ChangeRecord = Schemas["ChangeRecord"];
export type Noted = Schemas["Noted"];
export type Figures = Schemas["Figures"];
export type Sample = Schemas["Sample"];
export type BatteryHistory = Schemas["BatteryHistory"];

const IDLE_MS = 2000;
const RUNNING_MS = 400;
const path = (slug: string) => `/api/live/devices/${slug}/battery`;
const KEY = "battery";

/** Conditions change by themselves, and a test goes on: it is looked at as long as it is shown. */
export const batteryQuery = (slug: string) =>
  queryOptions({
    queryKey: [KEY, slug],
    queryFn: ({ signal }) => get<Battery>(path(slug), signal),
    refetchInterval: (query) => (query.state.data?.running ? RUNNING_MS : IDLE_MS),
    staleTime: 0,
  });

/** Kept tests and changes: asked anew whenever a test or a change has ended. */
export const batteryHistoryQuery = (slug: string) =>
  queryOptions({
    queryKey: ["battery-history", slug],
    queryFn: ({ signal }) => get<BatteryHistory>(`/api/batteries/${slug}`, signal),
    staleTime: 0,
  });

export const battery = {
  test: (slug: string) => send<RunningTest>("POST", `${path(slug)}/test`, {}),
  cancel: (slug: string) => send<unknown>("POST", `${path(slug)}/test/cancel`, {}),
  charge: (slug: string) => send<unknown>("POST", `${path(slug)}/charge`, {}),
  note: (slug: string, serials: string) => send<Noted>("POST", `${path(slug)}/change`, { serials }),
  giveUp: (slug: string) => send<unknown>("POST", `${path(slug)}/change/give-up`, {}),
  done: (slug: string, serials: string, remark: string) =>
    send<ChangeRecord>("POST", `${path(slug)}/change/done`, { serials, remark }),
};
