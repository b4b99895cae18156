/** Test signals, their runs, and the touch probe of an axis. */
import { queryOptions } from "@tanstack/react-query";
import { get, send } from "./client";
import type { components } from "./generated";
import type { Order } from "./motion";

type Schemas = components["schemas"];

export type SignalSettings = Schemas["SignalSettings"];
export type SignalLine = Schemas["SignalRunLine"];
export type SignalRun = Schemas["SignalRunDoc"];
export type Course = Schemas["CourseDoc"];
export type Probe = Schemas["ProbeLine"];
export type Proposal = Schemas["ProposalDoc"];

const axis = (slug: string) => `/api/live/devices/${slug}/motion`;
const LOOK_MS = 250;

/** The latest runs of an axis, newest first. */
export const runsQuery = (slug: string) =>
  queryOptions({
    queryKey: ["signals", slug],
    queryFn: ({ signal }) => get<SignalLine[]>(`${axis(slug)}/signals`, signal),
  });

/** One run with its courses; it never changes. */
export const runQuery = (id: string) =>
  queryOptions({
    queryKey: ["signal", id],
    queryFn: ({ signal }) => get<SignalRun>(`/api/signals/${id}`, signal),
  });

/** The bench reads the probe as long as somebody asks. */
export const probeQuery = (slug: string) =>
  queryOptions({
    queryKey: ["probe", slug],
    queryFn: ({ signal }) => get<Probe>(`${axis(slug)}/probe`, signal),
    refetchInterval: LOOK_MS,
    staleTime: 0,
    gcTime: 0,
  });

export const signals = {
  run: (slug: string, order: Order, signal: SignalSettings) =>
    send<SignalRun>("POST", `${axis(slug)}/signal`, { ...order, signal }),
  armProbe: (slug: string) => send<Probe>("POST", `${axis(slug)}/probe/arm`, {}),
};
