/** The scope over HTTP: what it does, arming it, and the captures that are kept. Times are in s since the trigger. */
import { keepPreviousData, queryOptions } from "@tanstack/react-query";
import { get, remove, send } from "./client";
import type { components } from "./generated";
import type { Language } from "./types";

type Schemas = components["schemas"];

export type ScopeLine = Schemas["ScopeLine"];
export type ScopeLive = Schemas["ScopeView"];
export type SignalRate = Schemas["SignalRate"];
export type ScopeSeries = Schemas["ScopeSeries"];
export type ArmRequest = Schemas["ArmRequest"];
export type TriggerIn = Schemas["TriggerIn"];
export type Capture = Schemas["CaptureDoc"];
/** A capture in the list of all. */
export type CaptureLine = Schemas["CaptureLine"];
export type CaptureHead = Schemas["Head"];
export type KeptSignal = Schemas["KeptSignal"];
export type KeptMark = Schemas["KeptMark"];
export type InForceRow = Schemas["InForceDoc"];
export type Spectrum = Schemas["Spectrum"];
export type XyPoints = Schemas["XyPoints"];

/** A stretch in s since the trigger; null is all. */
export type Span = readonly [number, number] | null;

const LIVE = "/api/live/scope";
const KEPT = "/api/scope/captures";
const ARMED_MS = 400;
const IDLE_MS = 2000;
const VIEW_MS = 250;
const KEY = ["scope"] as const;

const of = (id: string) => `${KEPT}/${encodeURIComponent(id)}`;
export const isArmed = (line: ScopeLine | undefined): boolean =>
  line?.phase === "waiting" || line?.phase === "capturing";

export const scopeQuery = queryOptions({
  queryKey: [...KEY, "line"],
  queryFn: ({ signal }) => get<ScopeLine>(LIVE, signal),
  staleTime: 0,
  refetchInterval: (query) => (isArmed(query.state.data) ? ARMED_MS : IDLE_MS),
});

export const liveQuery = (shown: boolean) =>
  queryOptions({
    queryKey: [...KEY, "live"],
    queryFn: ({ signal }) => get<ScopeLive>(`${LIVE}/view?points=600`, signal),
    staleTime: 0,
    gcTime: 0,
    enabled: shown,
    refetchInterval: VIEW_MS,
  });

export const capturesQuery = queryOptions({
  queryKey: [...KEY, "captures"],
  queryFn: ({ signal }) => get<CaptureLine[]>(KEPT, signal),
  staleTime: 0,
  refetchInterval: IDLE_MS,
});

const spanOf = (span: Span): [string, string][] =>
  span === null
    ? []
    : [
        ["from_s", String(span[0])],
        ["to_s", String(span[1])],
      ];

export const captureQuery = (id: string) =>
  queryOptions({
    queryKey: [...KEY, "capture", id],
    queryFn: ({ signal }) => get<Capture>(of(id), signal),
    retry: false,
    staleTime: 0,
  });

export const seriesQuery = (id: string, span: Span, points: number) =>
  queryOptions({
    queryKey: [...KEY, "series", id, span, points],
    queryFn: ({ signal }) => {
      const search = new URLSearchParams([...spanOf(span), ["points", String(points)]]);
      return get<ScopeSeries[]>(`${of(id)}/series?${search}`, signal);
    },
    placeholderData: keepPreviousData,
    retry: false,
    gcTime: 60_000,
  });

export const spectrumQuery = (id: string, signalName: string, span: Span) =>
  queryOptions({
    queryKey: [...KEY, "spectrum", id, signalName, span],
    queryFn: ({ signal }) => {
      const search = new URLSearchParams([["signal", signalName], ...spanOf(span)]);
      return get<Spectrum>(`${of(id)}/spectrum?${search}`, signal);
    },
    enabled: signalName !== "",
    retry: false,
    gcTime: 60_000,
  });

export const xyQuery = (id: string, x: string, y: string, span: Span) =>
  queryOptions({
    queryKey: [...KEY, "xy", id, x, y, span],
    queryFn: ({ signal }) => {
      const search = new URLSearchParams([["x", x], ["y", y], ...spanOf(span)]);
      return get<XyPoints>(`${of(id)}/xy?${search}`, signal);
    },
    enabled: x !== "" && y !== "",
    placeholderData: keepPreviousData,
    retry: false,
    gcTime: 60_000,
  });

export const inForceQuery = (id: string) =>
  queryOptions({
    queryKey: [...KEY, "in force", id],
    queryFn: ({ signal }) => get<InForceRow[]>(`${of(id)}/parameters`, signal),
    staleTime: 0,
    refetchInterval: 5000,
  });

export const csvOfCapture = (id: string, language: Language): string => `${of(id)}/csv?language=${language}`;
export const jsonOfCapture = (id: string): string => `${of(id)}/json`;

export const scopeOrders = {
  arm: (order: ArmRequest) => send<ScopeLine>("POST", `${LIVE}/arm`, order),
  trigger: () => send<ScopeLine>("POST", `${LIVE}/trigger`, {}),
  stop: () => send<ScopeLine>("POST", `${LIVE}/stop`, {}),
  change: (id: string, name: string, note: string) => send<Capture>("PATCH", of(id), { name, note }),
  remove: (id: string) => remove<object>(of(id)),
};

/** Of all that the scope shows. */
export const scopeKeys = { queryKey: KEY };
