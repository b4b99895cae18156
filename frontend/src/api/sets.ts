/** The library of parameter sets: records, values, tags, files in and out, nameplates, sets out of recordings. */
import { queryOptions } from "@tanstack/react-query";
import { get, send } from "./client";
import type { components } from "./generated";
import type { DescriptionDoc, SetDoc, SetList, SetRecord } from "./types";

type Schemas = components["schemas"];
export type Nameplate = Schemas["NameplateDoc"];
export type SetTaken = Schemas["SetTaken"];
export type Recovered = Schemas["RecoveredSets"];
export type LeftNow = Schemas["LeftNow"];
export type TagName = Schemas["TagChange"]["tag"];
export type SetImport = Schemas["SetImport"];
export type SetFormat = "json" | "dcf" | "csv";

const FILLING_MS = 700;
const GROWING_MS = 10_000;
const LEAVING_MS = 3000;

/** Asked again at once while files of the data folder wait to be read. */
export const setsQuery = queryOptions({
  queryKey: ["sets"],
  queryFn: ({ signal }) => get<SetList>("/api/sets", signal),
  staleTime: 0,
  refetchInterval: (query) => ((query.state.data?.waiting ?? 0) > 0 ? FILLING_MS : GROWING_MS),
});

/** A set never changes; its tags do. */
export const setQuery = (id: string | undefined) =>
  queryOptions({
    queryKey: ["sets", "one", id],
    queryFn: ({ signal }) => get<SetDoc>(`/api/sets/${id ?? ""}`, signal),
    enabled: id !== undefined,
    staleTime: Infinity,
  });

/** The description of a kind of device, connected or not. */
export const knownDescriptionQuery = (id: string) =>
  queryOptions({
    queryKey: ["description", "known", id],
    queryFn: ({ signal }) => get<DescriptionDoc>(`/api/descriptions/${id}`, signal),
    staleTime: Infinity,
    retry: false,
  });

export const nameplatesQuery = queryOptions({
  queryKey: ["nameplates"],
  queryFn: ({ signal }) => get<Nameplate[]>("/api/nameplates", signal),
});

/** What would be kept of each device as left, were the visit ended now. */
export const leftQuery = queryOptions({
  queryKey: ["visit", "left"],
  queryFn: ({ signal }) => get<LeftNow[]>("/api/live/visit/left", signal),
  staleTime: 0,
  refetchInterval: LEAVING_MS,
});

export const setDownload = (id: string, format: SetFormat) => `/api/sets/${id}/download?format=${format}`;

export const library = {
  tag: (id: string, tag: TagName, on: boolean) =>
    send<SetRecord>("POST", `/api/sets/${id}/tags`, { tag, on }),
  importFile: (file: SetImport) => send<SetTaken>("POST", "/api/sets/import", file),
  recover: (recording: string) =>
    send<Recovered>("POST", `/api/recordings/${encodeURIComponent(recording)}/recover-sets`, {}),
  typeNameplate: (device: string, serial: string, again: string) =>
    send<Nameplate>("PUT", "/api/nameplates", { device, serial, again }),
};
