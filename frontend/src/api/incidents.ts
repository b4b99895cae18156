/** Incidents and annotations over HTTP: marked, changed, carried away as one file and opened from one. Times are in ns. */
import { queryOptions } from "@tanstack/react-query";
import { get, remove, send, sendFile } from "./client";
import type { components } from "./generated";
import type { Language } from "./types";

type Schemas = components["schemas"];

export type Incident = Schemas["IncidentDoc"];
export type IncidentTaken = Schemas["IncidentTaken"];
export type Annotation = Schemas["AnnotationDoc"];
export type AnnotationList = Schemas["AnnotationList"];
export type Severity = Annotation["severity"];

/** What a person says of a stretch of a recording. */
export type IncidentWords = Pick<
  Incident,
  "from_ns" | "to_ns" | "at_ns" | "title" | "notes" | "tags" | "plots" | "camera" | "loop"
>;
export type MarkWords = Pick<Annotation, "from_ns" | "to_ns" | "text" | "severity">;

const ROOT = "/api/incidents";
const MANY = ["incidents"] as const;
const pathOf = (key: string) => `${ROOT}/${encodeURIComponent(key)}`;
const marksOf = (recording: string) => `/api/recordings/${encodeURIComponent(recording)}/annotations`;

export const SEVERITIES: readonly Severity[] = ["info", "warning", "error"];

/** Of all that concerns incidents. */
export const incidentKeys = { queryKey: MANY };

export const incidentsQuery = queryOptions({
  queryKey: [...MANY, "list"],
  queryFn: ({ signal }) => get<Incident[]>(ROOT, signal),
  staleTime: 0,
});

/** One by its id or its code. */
export const incidentQuery = (key: string | undefined) =>
  queryOptions({
    queryKey: [...MANY, "one", key],
    queryFn: ({ signal }) => get<Incident>(pathOf(key ?? ""), signal),
    enabled: key !== undefined,
    staleTime: 0,
    retry: false,
  });

/** All versions, newest first. */
export const versionsQuery = (key: string) =>
  queryOptions({
    queryKey: [...MANY, "versions", key],
    queryFn: ({ signal }) => get<Incident[]>(`${pathOf(key)}/versions`, signal),
    staleTime: 0,
  });

export const annotationsQuery = (recording: string) =>
  queryOptions({
    queryKey: [...MANY, "annotations", recording],
    queryFn: ({ signal }) => get<AnnotationList>(marksOf(recording), signal),
    staleTime: 0,
  });

export const incidents = {
  keep: (recording: string, words: IncidentWords) =>
    send<Incident>("POST", ROOT, { recording, ...exact(words) }),
  change: (key: string, basedOn: number, words: IncidentWords) =>
    send<Incident>("PUT", pathOf(key), { based_on: basedOn, ...exact(words) }),
  hide: (key: string) => remove<object>(pathOf(key)),
  take: (file: File) =>
    sendFile<IncidentTaken>(`${ROOT}/import?${new URLSearchParams({ name: file.name })}`, file),
};

export const annotations = {
  add: (recording: string, words: MarkWords, incident: string | null = null) =>
    send<Annotation>("POST", marksOf(recording), { ...exact(words), incident }),
  change: (id: string, words: MarkWords) =>
    send<Annotation>("PUT", `/api/annotations/${encodeURIComponent(id)}`, exact(words)),
  remove: (id: string) => remove<object>(`/api/annotations/${encodeURIComponent(id)}`),
};

export const bundleDownload = (key: string) => `${pathOf(key)}/bundle`;
export const reportDownload = (key: string, language: Language) =>
  `${pathOf(key)}/report?language=${language}`;

/** Whole nanoseconds, as the server takes them. */
function exact<W extends IncidentWords | MarkWords>(words: W): W {
  const { from_ns, to_ns } = words;
  const rounded = { ...words, from_ns: Math.round(from_ns), to_ns: Math.round(to_ns) };
  return "at_ns" in rounded ? { ...rounded, at_ns: Math.round(rounded.at_ns) } : rounded;
}
