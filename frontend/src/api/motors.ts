/** The motor database: plate data and parameters of motors, with all their versions. */
import { queryOptions } from "@tanstack/react-query";
import { get, remove, send } from "./client";
import type { components } from "./generated";
import { queryClient } from "./queries";
import type { DescriptionDoc } from "./types";

type Schemas = components["schemas"];

export type Motor = Schemas["MotorDoc"];
export type MotorList = Schemas["MotorList"];
export type Assigned = Schemas["AssignedDoc"];
export type Plate = Schemas["PlateDoc"];
export type PlateField = Schemas["PlateFieldDoc"];
export type MotorDraft = Schemas["DraftIn"];
export type MotorsTaken = Schemas["MotorsTaken"];
export type MotorComparison = Schemas["MotorComparison"];
export type PlateRow = Schemas["PlateRowDoc"];
export type ValueRow = Schemas["ValueRowDoc"];
export type Side = Schemas["SideDoc"];

export interface MotorForm {
  plate: PlateField[];
  description: DescriptionDoc;
}

const ROOT = "/api/motors";
const of = (id: string) => `${ROOT}/${encodeURIComponent(id)}`;

export const motorsQuery = queryOptions({
  queryKey: ["motors", "list"],
  queryFn: ({ signal }) => get<MotorList>(ROOT, signal),
  staleTime: 0,
});

export const motorFormQuery = queryOptions({
  queryKey: ["motor-form"],
  queryFn: ({ signal }) => get<MotorForm>(`${ROOT}/form`, signal),
});

export const motorVersionsQuery = (id: string) =>
  queryOptions({
    queryKey: ["motors", "versions", id],
    queryFn: ({ signal }) => get<Motor[]>(`${of(id)}/versions`, signal),
    staleTime: 0,
  });

/** Of two of `motor:ID`, `motor:ID@VERSION` and `live:SLUG`; a device may change at any time. */
export const motorCompareQuery = (left: string, right: string) =>
  queryOptions({
    queryKey: ["motors", "compare", left, right],
    queryFn: ({ signal }) =>
      get<MotorComparison>(
        `${ROOT}/compare?left=${encodeURIComponent(left)}&right=${encodeURIComponent(right)}`,
        signal,
      ),
    staleTime: 0,
  });

export const motorExport = (id?: string) =>
  `${ROOT}/export${id === undefined ? "" : `?ids=${encodeURIComponent(id)}`}`;

export const motorCommands = {
  add: (draft: MotorDraft) => send<Motor>("POST", ROOT, draft),
  change: (id: string, based_on: number, draft: MotorDraft) =>
    send<Motor>("PUT", of(id), { ...draft, based_on }),
  remove: (id: string) => remove<object>(of(id)),
  assign: (id: string, version: number, device: string) =>
    send<object>("POST", `${of(id)}/assign`, { device, version }),
  addFrom: (slug: string, known: Omit<MotorDraft, "values">) =>
    send<Motor>("POST", `/api/live/devices/${slug}/motor`, known),
  take: async (file: File) =>
    send<MotorsTaken>("POST", `${ROOT}/import`, { name: file.name, data: await base64(file) }),
};

/** Everything that was asked about motors may have changed. */
export const motorsChanged = () => queryClient.invalidateQueries({ queryKey: ["motors"] });

const CHUNK = 8192;

/** The bytes as they are: whether they are UTF-8 is for the server to say. */
async function base64(file: File): Promise<string> {
  const bytes = new Uint8Array(await file.arrayBuffer());
  let text = "";
  for (let at = 0; at < bytes.length; at += CHUNK)
    text += String.fromCharCode(...bytes.subarray(at, at + CHUNK));
  return btoa(text);
}
