import { QueryClient, queryOptions } from "@tanstack/react-query";
import { baseOf, LIVE } from "../live/channel";
import { useShown } from "../live/live";
import { get, Problem } from "./client";
import type { DescriptionDoc, Job, Language, Session, Turbine } from "./types";

const POLL_MS = 250;

export const queryClient = new QueryClient({
  defaultOptions: {
    // The bench is on this computer or beside it: what the browser thinks of the internet must not hold a STOP back, nor
    // send an order when nobody presses it any more.
    mutations: { networkMode: "always" },
    queries: {
      networkMode: "always",
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

const turbineOf = (ctx: string) =>
  queryOptions({
    queryKey: ["turbine", ctx],
    queryFn: ({ signal }) => get<Turbine | null>(`${baseOf(ctx)}/turbine`, signal),
    select: (turbine) => turbine ?? undefined,
  });

const descriptionOf = (ctx: string, id: string) =>
  queryOptions({
    queryKey: ["description", ctx, id],
    queryFn: ({ signal }) => get<DescriptionDoc>(`${baseOf(ctx)}/descriptions/${id}`, signal),
  });

/** The turbine that is connected, whatever the page shows. */
export const turbineQuery = turbineOf(LIVE);
export const descriptionQuery = (id: string) => descriptionOf(LIVE, id);

/** The turbine that is shown where this is called: the connected one, or that of a recording. */
export const useTurbineQuery = () => turbineOf(useShown().ctx);

/** How devices are described that are shown where this is called. */
export function useDescriptionQuery(): typeof descriptionQuery {
  const { ctx } = useShown();
  return (id) => descriptionOf(ctx, id);
}

export const jobQuery = (id: string | null) =>
  queryOptions({
    queryKey: ["job", id],
    queryFn: ({ signal }) => get<Job>(`/api/live/jobs/${id ?? ""}`, signal),
    enabled: id !== null,
    staleTime: 0,
    refetchInterval: (query) => (query.state.data && query.state.data.state !== "running" ? false : POLL_MS),
  });
