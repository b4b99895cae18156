/** Restores: the plan before, the run itself, and what was run before. */
import { queryOptions } from "@tanstack/react-query";
import { get, send } from "./client";
import type { components } from "./generated";
import type { Language } from "./types";

type Schemas = components["schemas"];

export type PlaceRef = Schemas["RestorePlace"];
export type PlanRow = Schemas["RestorePlanRow"];
export type PlanFinding = Schemas["RestoreFinding"];
export type PlanSource = Schemas["RestoreSource"];
export type Refusal = Schemas["RestoreRefusal"];
export type PlanDoc = Schemas["RestorePlanDoc"];
export type PlanRequest = Schemas["RestorePlanRequest"];
export type RestoreRequest = Schemas["RestoreRequest"];
export type RestoreHead = Schemas["RestoreHead"];
export type RestoreDoc = Schemas["RestoreDoc"];
export type RestoreValue = Schemas["RestoreValue"];
export type RestoreStep = Schemas["RestoreStepDoc"];
/** What a person orders without giving a reason. */
export type Way = Exclude<RestoreDoc["can"][number], "give-up">;

const RUN_POLL_MS = 400;
const WATCH_MS = 3000;
const IDLE_WATCH_MS = 15_000;

/** Every device of the station is read for it, and nothing is written. */
export const planQuery = (order: PlanRequest | null) =>
  queryOptions({
    queryKey: ["restore-plan", order],
    queryFn: () => send<PlanDoc>("POST", "/api/live/restore/plan", order ?? {}),
    enabled: order !== null,
    staleTime: 0,
    gcTime: 0,
    retry: false,
  });

export const startRestore = (order: RestoreRequest): Promise<RestoreDoc> =>
  send("POST", "/api/live/restore", order);

const pathOf = (id: string) => `/api/live/restores/${encodeURIComponent(id)}`;

export const takeWay = (id: string, way: Way): Promise<RestoreDoc> =>
  send("POST", `${pathOf(id)}/${way}`, {});

export const giveUp = (id: string, reason: string): Promise<RestoreDoc> =>
  send("POST", `${pathOf(id)}/give-up`, { reason });

/** True where somebody must still look after it: it runs, waits for a person, or was cut off. */
export const isOpen = ({ state }: RestoreHead): boolean =>
  state !== "done" && state !== "rolled-back" && state !== "given-up";

export const restoresQuery = queryOptions({
  queryKey: ["restores"],
  queryFn: ({ signal }) => get<RestoreHead[]>("/api/live/restores", signal),
  staleTime: 0,
  refetchInterval: (query) => (query.state.data?.some(isOpen) ? WATCH_MS : IDLE_WATCH_MS),
});

/** Those alone that somebody must still look after, however many came after them. */
export const openRestoresQuery = queryOptions({
  queryKey: [...restoresQuery.queryKey, "open"],
  queryFn: ({ signal }) => get<RestoreHead[]>("/api/live/restores?open=true", signal),
  staleTime: 0,
  refetchInterval: (query) => ((query.state.data?.length ?? 0) > 0 ? WATCH_MS : IDLE_WATCH_MS),
});

export const restoreQuery = (id: string) =>
  queryOptions({
    queryKey: ["restore", id],
    queryFn: ({ signal }) => get<RestoreDoc>(pathOf(id), signal),
    staleTime: 0,
    refetchInterval: (query) => {
      const doc = query.state.data;
      if (!doc || !isOpen(doc)) return false;
      return doc.running ? RUN_POLL_MS : WATCH_MS;
    },
  });

export type RecordFormat = "html" | "pdf" | "json";
/** The signed record of a restore, of which the id is the same. */
export const recordPath = (id: string, format: RecordFormat, language: Language): string =>
  `/api/records/${encodeURIComponent(id)}.${format}?locale=${language}`;
