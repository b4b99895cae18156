/** The settings of the bench: adapters, the site file, polling, users, the audit log, and signing in and out. */
import { queryOptions } from "@tanstack/react-query";
import { get, remove, send } from "./client";
import type { components } from "./generated";

type Schemas = components["schemas"];

export type Adapter = Schemas["AdapterDoc"];
export type Adapters = Schemas["AdaptersDoc"];
export type Place = Schemas["PlaceDoc"];
export type SettingsJob = Schemas["SettingsJobDoc"];
export type Heard = Schemas["HeardDoc"];
export type BitrateSearch = Schemas["SearchDoc"];
export type Scan = Schemas["ScanDoc"];
export type Identified = Schemas["IdentifiedDoc"];
export type FoundDevice = Schemas["FoundDoc"];
export type Site = Schemas["SiteDoc"];
export type SiteTurbine = Schemas["SiteTurbineDoc"];
export type SiteStation = Schemas["SiteStationDoc"];
export type SiteDevice = Schemas["SiteDeviceDoc"];
export type SiteBus = Schemas["BusDoc"];
export type Polling = Schemas["PollingDoc"];
export type PollDevice = Schemas["PollDevice"];
export type PollItem = Schemas["PollItem"];
export type PollBus = Schemas["PollBus"];
export type PollChoice = Schemas["PollChoice"];
export type PollingChange = Schemas["PollingChange"];
export type About = Schemas["AboutDoc"];
export type User = Schemas["UserDoc"];
export type UserChange = Schemas["UserChange"];
export type NewUser = Schemas["NewUser"];
export type KnownTurbine = Schemas["KnownTurbine"];
export type Visit = Schemas["VisitDoc"];
export type AuditLine = Schemas["AuditLine"];
export type AuditPage = Schemas["AuditPage"];
export type AuditHead = Schemas["AuditHead"];
export type AuditVerified = Schemas["AuditVerified"];

const ROOT = "/api/settings";
const POLL_MS = 250;
const path = encodeURIComponent;

export const adaptersQuery = queryOptions({
  queryKey: ["settings", "adapters"],
  queryFn: ({ signal }) => get<Adapters>(`${ROOT}/adapters`, signal),
  staleTime: 0,
});

export const siteQuery = queryOptions({
  queryKey: ["settings", "site"],
  queryFn: ({ signal }) => get<Site>(`${ROOT}/site`, signal),
  staleTime: 0,
});

export const pollingQuery = queryOptions({
  queryKey: ["settings", "polling"],
  queryFn: ({ signal }) => get<Polling>(`${ROOT}/polling`, signal),
  staleTime: 0,
});

export const pollChoicesQuery = (id: string) =>
  queryOptions({
    queryKey: ["settings", "polling", "choices", id],
    queryFn: ({ signal }) => get<PollChoice[]>(`${ROOT}/polling/choices/${path(id)}`, signal),
  });

export const aboutQuery = queryOptions({
  queryKey: ["settings", "about"],
  queryFn: ({ signal }) => get<About>(`${ROOT}/about`, signal),
});

export const settingsJobQuery = (id: string | null) =>
  queryOptions({
    queryKey: ["settings", "job", id],
    queryFn: ({ signal }) => get<SettingsJob>(`${ROOT}/jobs/${id ?? ""}`, signal),
    enabled: id !== null,
    staleTime: 0,
    refetchInterval: (query) => (query.state.data && query.state.data.state !== "running" ? false : POLL_MS),
  });

export const usersQuery = queryOptions({
  queryKey: ["settings", "users"],
  queryFn: ({ signal }) => get<User[]>("/api/users", signal),
  staleTime: 0,
});

export const knownTurbinesQuery = queryOptions({
  queryKey: ["turbines"],
  queryFn: ({ signal }) => get<KnownTurbine[]>("/api/turbines", signal),
  staleTime: 0,
});

export const visitQuery = queryOptions({
  queryKey: ["visit"],
  queryFn: ({ signal }) => get<Schemas["PresentVisit"]>("/api/live/visit", signal),
  staleTime: 0,
});

export const auditHeadQuery = queryOptions({
  queryKey: ["audit", "head"],
  queryFn: ({ signal }) => get<AuditHead>("/api/audit/head", signal),
  staleTime: 0,
});

export interface AuditFilter {
  q: string;
  person: string;
  kind: string;
  device: string;
}

export function auditPage(
  filter: AuditFilter,
  before: number | null,
  limit: number,
  signal?: AbortSignal,
): Promise<AuditPage> {
  const search = new URLSearchParams({ limit: String(limit) });
  if (before !== null) search.set("before", String(before));
  for (const [name, text] of Object.entries(filter) as [keyof AuditFilter, string][]) {
    if (text !== "") search.set(name, text);
  }
  return get<AuditPage>(`/api/audit?${search.toString()}`, signal);
}

export const settings = {
  test: (connection: string, bitrate: number, sure: boolean) =>
    send<SettingsJob>("POST", `${ROOT}/adapters/test`, { connection, bitrate, sure }),
  search: (connection: string) => send<SettingsJob>("POST", `${ROOT}/adapters/bitrate`, { connection }),
  scan: ({ connection, bitrate, master }: SiteBus, consent: boolean) =>
    send<SettingsJob>("POST", `${ROOT}/scan`, { connection, bitrate: bitrate || undefined, consent, master }),
  identify: (address: string) => send<SettingsJob>("POST", `${ROOT}/identify`, { address }),
  addTurbine: (revision: string, turbine: SiteTurbine) =>
    send<Site>("POST", `${ROOT}/site/turbines`, { revision, turbine }),
  changeTurbine: (revision: string, turbine: SiteTurbine) =>
    send<Site>("PUT", `${ROOT}/site/turbines/${path(turbine.slug)}`, { revision, turbine }),
  removeTurbine: (revision: string, slug: string) =>
    remove<Site>(`${ROOT}/site/turbines/${path(slug)}?revision=${path(revision)}`),
  changePolling: (change: PollingChange) => send<Polling>("PUT", `${ROOT}/polling`, change),
  addUser: (user: NewUser) => send<User>("POST", "/api/users", user),
  changeUser: (id: string, change: UserChange) => send<User>("PATCH", `/api/users/${path(id)}`, change),
  ownPassword: (old: string, next: string) => send<object>("POST", "/api/password", { old, new: next }),
  verifyAudit: () => send<AuditVerified>("POST", "/api/audit/verify", {}),
};

export const connecting = {
  connect: (turbine: string) => send<object>("POST", "/api/live/connect", { turbine }),
  disconnect: () => send<object>("POST", "/api/live/disconnect", {}),
  endVisit: (reason: string, work_order: string) =>
    send<Visit>("POST", "/api/live/visit/end", { reason, work_order }),
  changeVisit: (reason: string, work_order: string) =>
    send<Visit>("PATCH", "/api/live/visit", { reason, work_order }),
};

export const signing = {
  in: (name: string, password: string) => send<object>("POST", "/api/login", { name, password }),
  out: () => send<object>("POST", "/api/logout", {}),
};

/** Another person, or nobody: nothing of what was known or drawn so far may stay. */
export function startAfresh(): void {
  location.reload();
}
