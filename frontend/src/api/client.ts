import type {
  Job,
  ProblemDoc,
  Raw,
  RestartResult,
  VerifyResult,
  SaveResult,
  StopResult,
  WriteResult,
  WritesRequest,
} from "./types";

/** A request that the server or the device refused, with all that it said. */
export class Problem extends Error {
  readonly doc: ProblemDoc;

  constructor(doc: ProblemDoc) {
    super(doc.title);
    this.doc = doc;
  }
}

/** The server did not answer at all. */
export class Unreachable extends Error {}

const UNAUTHORISED = 401;
/** Here a refusal says nothing new of the session. */
const SIGNING_IN = ["/api/session", "/api/login"];
let tellSignedOut: () => void = () => undefined;

/** Calls `told` where the server no longer knows the session: it has ended, or another login is needed. */
export function onSignedOut(told: () => void): void {
  tellSignedOut = told;
}

/** The session has ended, as the server says. */
export function signedOut(): void {
  tellSignedOut();
}

/** What the page shows, as its address says: the server lets no page write that shows a recording. */
function contextHeader(): Record<string, string> {
  const replay = new URLSearchParams(location.search).get("replay");
  return replay === null ? {} : { "X-Hubside-Context": `replay/${encodeURIComponent(replay)}` };
}

type Init = RequestInit & { headers?: Record<string, string> };

async function answerOf(path: string, init: Init): Promise<Response> {
  let response: Response;
  const headers = Object.assign({}, init.headers, contextHeader());
  try {
    response = await fetch(path, { credentials: "same-origin", ...init, headers });
  } catch (cause) {
    throw new Unreachable(path, { cause });
  }
  if (response.status === UNAUTHORISED && !SIGNING_IN.includes(path)) signedOut();
  if (!response.ok) throw new Problem(await problemOf(response));
  return response;
}

async function request<T>(path: string, init: Init): Promise<T> {
  return (await (await answerOf(path, init)).json()) as T;
}

async function problemOf(response: Response): Promise<ProblemDoc> {
  const plain: ProblemDoc = {
    type: "about:blank",
    title: response.statusText,
    status: response.status,
    code: `http_${response.status}`,
    text_key: "page.error.http",
    details: { status: response.status },
    device_state: null,
  };
  if (!response.headers.get("content-type")?.includes("json")) return plain;
  try {
    const doc = (await response.json()) as Partial<ProblemDoc>;
    return { ...plain, ...doc, details: doc.details ?? plain.details };
  } catch {
    return plain;
  }
}

export function get<T>(path: string, signal?: AbortSignal): Promise<T> {
  return request<T>(path, { method: "GET", ...(signal ? { signal } : {}) });
}

export function send<T>(
  method: "POST" | "PUT" | "PATCH",
  path: string,
  body: object,
  signal?: AbortSignal,
): Promise<T> {
  return request<T>(path, {
    method,
    headers: { "content-type": "application/json" },
    body: JSON.stringify(body),
    ...(signal ? { signal } : {}),
  });
}

/** Sends JSON and gets a file, in the language of the page. */
export async function sendForFile(path: string, body: object, language: string): Promise<Blob> {
  const headers = { "content-type": "application/json", "accept-language": language };
  const answer = await answerOf(path, { method: "POST", headers, body: JSON.stringify(body) });
  return answer.blob();
}

/** Sends a file as it is. */
export function sendFile<T>(path: string, file: Blob): Promise<T> {
  return request<T>(path, {
    method: "POST",
    headers: { "content-type": "application/octet-stream" },
    body: file,
  });
}

export function remove<T>(path: string): Promise<T> {
  return request<T>(path, { method: "DELETE" });
}

function post<T>(path: string, body: object): Promise<T> {
  return send<T>("POST", path, body);
}

const device = (slug: string) => `/api/live/devices/${slug}`;

export const commands = {
  read: (slug: string, addresses: string[] | null) => post<Job>(`${device(slug)}/read`, { addresses }),
  write: (slug: string, address: string, raw: Raw) =>
    post<WriteResult>(`${device(slug)}/write`, { address, raw }),
  writes: (order: WritesRequest) => post<Job>("/api/live/writes", order),
  save: (slug: string, category: string | null = null) =>
    post<SaveResult>(`${device(slug)}/save`, { category }),
  restart: (slug: string) => post<RestartResult>(`${device(slug)}/restart`, {}),
  verify: (slug: string) => post<VerifyResult>(`${device(slug)}/verify`, {}),
  consent: () => post<object>("/api/live/consent", {}),
  stop: (press: object, signal: AbortSignal) => send<StopResult>("POST", "/api/live/stop", press, signal),
  feather: (press: object, signal: AbortSignal) =>
    send<StopResult>("POST", "/api/live/feather", press, signal),
  stopOne: (slug: string, press: object, signal: AbortSignal) =>
    send<StopResult>("POST", `${device(slug)}/stop`, press, signal),
  backup: (reason: string) => post<Job>("/api/live/backup", { reason }),
  cancel: (id: string) => request<Job>(`/api/live/jobs/${id}`, { method: "DELETE" }),
};
