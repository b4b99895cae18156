/** Comparisons of parameter sets: columns side by side, and one golden set against the fleet. */
import { keepPreviousData, queryOptions } from "@tanstack/react-query";
import { get, send, sendForFile } from "./client";
import type { components } from "./generated";
import type { Language, Raw, SetList } from "./types";

type Schemas = components["schemas"];

export type ComparisonDoc = Schemas["ComparisonDoc"];
export type ColumnDoc = Schemas["ColumnDoc"];
export type RowDoc = Schemas["CompareRow"];
export type CellDoc = Schemas["CellDoc"];
export type BitLine = Schemas["BitDoc"];
export type ParityDoc = Schemas["ParityDoc"];
export type ParityPart = ParityDoc["parts"][number];
export type RowState = RowDoc["state"];
export type CellState = CellDoc["state"];

/** Changes that are not written yet: raw values by address, by device. */
export type Pending = Record<string, Record<string, Raw>>;

/** How often a column is asked for again that changes while it is looked at. */
const LIVE_MS = 2000;
export const LEAST_COLUMNS = 2;
export const MOST_COLUMNS = 12;

/** Parameters only, no process values. What was shown stays until what is asked for now is there. */
export const compareQuery = (columns: readonly string[], pending: Pending, live: boolean) =>
  queryOptions({
    queryKey: ["compare", columns, pending],
    queryFn: () => send<ComparisonDoc>("POST", "/api/compare", { columns, pending }),
    enabled: columns.length >= LEAST_COLUMNS,
    staleTime: 0,
    refetchInterval: (query) => (live && query.state.status === "success" ? LIVE_MS : false),
    placeholderData: keepPreviousData,
  });

/** The blades of a turbine by the newest set that is kept of each. */
export const parityQuery = (turbine: string | undefined) =>
  queryOptions({
    queryKey: ["parity", turbine],
    queryFn: ({ signal }) =>
      get<ParityDoc>(`/api/parity?kind=latest&turbine=${encodeURIComponent(turbine ?? "")}`, signal),
    enabled: turbine !== undefined,
    staleTime: 0,
  });

export type ExportFormat = "html" | "csv";

/** `same`: with the rows that match. */
export const exportComparison = (
  format: ExportFormat,
  columns: readonly string[],
  pending: Pending,
  same: boolean,
  language: Language,
): Promise<Blob> =>
  sendForFile(
    `/api/compare/export?format=${format}&same=${same ? "true" : "false"}`,
    { columns, pending },
    language,
  );

export const MOST_RECORDS = 2000;
const FRESH_MS = 5000;

/** Sets of the library, latest first; of one kind of device, or of all where it is null. */
export const recordsQuery = (kind: string | null, limit: number = MOST_RECORDS) =>
  queryOptions({
    queryKey: ["sets", "records", kind, limit],
    queryFn: async ({ signal }) => {
      const of = kind === null ? "" : `&description_id=${encodeURIComponent(kind)}`;
      return (await get<SetList>(`/api/sets?limit=${limit}${of}`, signal)).records;
    },
    staleTime: FRESH_MS,
  });
