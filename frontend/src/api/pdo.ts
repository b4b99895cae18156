/** PDOs of a device: how they are set up, what an edit would do, applying it, and putting the last change back. */
import { keepPreviousData, queryOptions } from "@tanstack/react-query";
import { baseOf } from "../live/channel";
import { get, send } from "./client";
import type { components } from "./generated";
import type { Job } from "./types";

type Schemas = components["schemas"];

export type Pdos = Schemas["PdosDoc"];
export type Pdo = Schemas["PdoDoc"];
export type PdoSetup = Schemas["PdoSetupDoc"];
export type PdoMapped = Schemas["PdoMapped"];
export type PdoMappable = Schemas["PdoMappable"];
export type PdoEdit = Schemas["PdoEdit"];
export type PdoFinding = Schemas["PdoFinding"];
export type PdoPreview = Schemas["PdoPreview"];
export type PdoWrite = Schemas["PdoWriteDoc"];
export type PdoLoad = Schemas["PdoLoadDoc"];
export type PdoUndo = Schemas["PdoUndo"];

const REFRESH_MS = 1000;

/** Rates and load change all the time; of a recording with its cursor. */
export const pdosQuery = (ctx: string, slug: string) =>
  queryOptions({
    queryKey: ["pdos", ctx, slug],
    queryFn: ({ signal }) => get<Pdos>(`${baseOf(ctx)}/devices/${slug}/pdos`, signal),
    staleTime: 0,
    refetchInterval: REFRESH_MS,
  });

export const pdoPreviewQuery = (slug: string, edits: readonly PdoEdit[]) =>
  queryOptions({
    queryKey: ["pdos", "preview", slug, edits],
    queryFn: () => send<PdoPreview>("POST", `/api/live/devices/${slug}/pdos/preview`, { edits }),
    staleTime: 0,
    gcTime: 10_000,
    placeholderData: keepPreviousData,
  });

export const pdoCommands = {
  apply: (slug: string, page: string, edits: readonly PdoEdit[]) =>
    send<Job>("POST", `/api/live/devices/${slug}/pdos/apply`, { page, edits }),
  undo: (slug: string, page: string) => send<Job>("POST", `/api/live/devices/${slug}/pdos/undo`, { page }),
};
