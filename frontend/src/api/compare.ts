/** Comparisons of parameter sets: columns side by side, and one golden set against the fleet. */
import { keepPreviousData, queryOptions } from "@tanstack/react-query";
import { send, sendForFile } from "./client";
import type { components } from "./generated";
import type { Raw } from "./types";

type Schemas = components["schemas"];

export type ComparisonDoc = Schemas["ComparisonDoc"];
export type ColumnDoc = Schemas["ColumnDoc"];
export type RowDoc = Schemas["CompareRow"];
export type CellDoc = Schemas["CellDoc"];
export type BitLine = Schemas["BitDoc"];
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

export type ExportFormat = "html" | "csv";

export const exportComparison = (
  format: ExportFormat,
  columns: readonly string[],
  pending: Pending,
): Promise<Blob> => sendForFile(`/api/compare/export?format=${format}`, { columns, pending });
