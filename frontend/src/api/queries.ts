import { QueryClient, queryOptions } from "@tanstack/react-query";
import { get, Problem } from "./client";
import type { DescriptionDoc, Job, Language, Session, Turbine } from "./types";

const POLL_MS = 250;

export const queryClient = new QueryClient({
  defaultOptions: {
    queries: {
      // A refusal stays a refusal; only silence is worth another try.
      retry: (failures, error) => !(error instanceof Problem) && failures < 3,
      refetchOnWindowFocus: false,
      staleTime: Infinity,
    },
  },
});

export const sessionQuery = queryOptions({
  queryKey: ["session"],
  queryFn: ({ signal }) => get<Session>("/api/session", signal),
});

export const textsQuery = (language: Language) =>
  queryOptions({
    queryKey: ["texts", language],
    queryFn: ({ signal }) => get<Record<string, string>>(`/api/texts/${language}`, signal),
  });

export const turbineQuery = queryOptions({
  queryKey: ["turbine"],
  queryFn: ({ signal }) => get<Turbine | null>("/api/live/turbine", signal),
  select: (turbine) => turbine ?? undefined,
});

export const descriptionQuery = (id: string) =>
  queryOptions({
    queryKey: ["description", id],
    queryFn: ({ signal }) => get<DescriptionDoc>(`/api/live/descriptions/${id}`, signal),
  });

export const jobQuery = (id: string | null) =>
  queryOptions({
    queryKey: ["job", id],
    queryFn: ({ signal }) => get<Job>(`/api/live/jobs/${id ?? ""}`, signal),
    enabled: id !== null,
    staleTime: 0,
    refetchInterval: (query) => (query.state.data && query.state.data.state !== "running" ? false : POLL_MS),
  });
