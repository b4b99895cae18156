/** Recordings to and from the files of other tools, cut and anonymised, over HTTP. Times are in ns. */
import { queryOptions } from "@tanstack/react-query";
import { get, remove, send, sendFile } from "./client";
import type { components } from "./generated";

type Schemas = components["schemas"];

export type ExchangeJob = Schemas["ExchangeJob"];
export type LossDoc = Schemas["LossDoc"];

export const FORMATS = ["candump", "asc", "blf", "trc", "csv", "pcapng", "mcap"] as const;
export type Format = (typeof FORMATS)[number];
/** What is read, too. */
export const IMPORTED: readonly Format[] = FORMATS.filter((one) => one !== "pcapng");

const LOOK_AGAIN_MS = 300;
const pathOf = (name: string) => `/api/recordings/${encodeURIComponent(name)}`;

/** What is exported; the ends as digits, null where the recording itself ends. */
export interface Export {
  format: Format;
  exact: boolean;
  startNs: string | null;
  endNs: string | null;
}

function exportSearch({ format, exact, startNs, endNs }: Export): URLSearchParams {
  const search = new URLSearchParams({ format, exact: String(exact) });
  if (startNs !== null) search.set("start_ns", startNs);
  if (endNs !== null) search.set("end_ns", endNs);
  return search;
}

/** The decoded signals as a table; no format of frames. */
export const tableDownload = (name: string) => `${pathOf(name)}/table`;

export const exportDownload = (name: string, wanted: Export) =>
  `${pathOf(name)}/export?${exportSearch(wanted)}`;

/** What the format cannot hold of it: every frame is looked at. */
export const lossesQuery = (name: string, wanted: Export) =>
  queryOptions({
    queryKey: ["recording", name, "losses", wanted],
    queryFn: async ({ signal }) =>
      (await get<Schemas["LossesDoc"]>(`${pathOf(name)}/losses?${exportSearch(wanted)}`, signal)).losses,
    retry: false,
  });

export interface Import {
  file: File;
  format: Format | null;
  turbine: string | null;
  lenient: boolean;
}

export const exchange = {
  take: ({ file, format, turbine, lenient }: Import) => {
    const search = new URLSearchParams({ file: file.name, lenient: String(lenient) });
    if (format !== null) search.set("format", format);
    if (turbine !== null) search.set("turbine", turbine);
    return sendFile<ExchangeJob>(`/api/recordings/import?${search}`, file);
  },
  cut: (name: string, start_ns: number, end_ns: number) =>
    send<ExchangeJob>("POST", `${pathOf(name)}/cut`, { start_ns, end_ns, buses: null }),
  join: (names: readonly string[]) =>
    send<ExchangeJob>("POST", "/api/recordings/merge", {
      recordings: names.map((name) => ({ name, offset_ns: 0, buses: {} })),
    }),
  anonymise: (name: string, hide_times: boolean) =>
    send<ExchangeJob>("POST", `${pathOf(name)}/anonymise`, { hide_times, objects: [], words: [] }),
  cancel: (id: string) => remove<ExchangeJob>(`/api/recordings/made/${encodeURIComponent(id)}`),
};

/** A job as it stands, asked for until it has ended. */
export const exchangeQuery = (id: string | null) =>
  queryOptions({
    queryKey: ["exchange", id],
    queryFn: ({ signal }) => get<ExchangeJob>(`/api/recordings/made/${encodeURIComponent(id ?? "")}`, signal),
    enabled: id !== null,
    staleTime: 0,
    refetchInterval: ({ state }) => (state.data && state.data.state !== "running" ? false : LOOK_AGAIN_MS),
  });
