/** Searching recordings for a signature, over HTTP. */
import { queryOptions } from "@tanstack/react-query";
import { get, remove, send } from "./client";
import type { components } from "./generated";

type Schemas = components["schemas"];

export type Signature = Schemas["SignatureDoc"];
export type Search = Schemas["SignatureSearchDoc"];
export type Hit = Schemas["HitDoc"];
export type Skipped = Schemas["SkippedDoc"];

const POLL_MS = 300;

/** A signature as it is understood; fails at the character where it is not. */
export const signatureQuery = (text: string) =>
  queryOptions({
    queryKey: ["signature", text],
    queryFn: () => send<Signature>("POST", "/api/search/signature", { text }),
    enabled: text.trim() !== "",
    retry: false,
  });

export const startSearch = (text: string, makeIndexes: boolean) =>
  send<Search>("POST", "/api/search", { text, make_indexes: makeIndexes });

const pathOf = (id: string) => `/api/search/${encodeURIComponent(id)}`;

export const cancelSearch = (id: string) => remove<Search>(pathOf(id));

/** A search as it stands, asked for until it has ended. */
export const searchQuery = (id: string | null) =>
  queryOptions({
    queryKey: ["search", id],
    queryFn: ({ signal }) => get<Search>(pathOf(id ?? ""), signal),
    enabled: id !== null,
    staleTime: 0,
    refetchInterval: ({ state }) => (state.data && state.data.state !== "running" ? false : POLL_MS),
  });
