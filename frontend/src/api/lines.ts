/** The lines of the connection and their stations: asked for again and again, of the present only. */
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { get, send } from "./client";
import type { components } from "./generated";

type Schemas = components["schemas"];

export type Line = Schemas["LineDoc"];
export type LineStation = Schemas["StationDoc"];
export type Telegram = Schemas["TelegramDoc"];
export type TelegramWord = Schemas["WordDoc"];
export type Diagnosis = Schemas["DiagnosisDoc"];
export type OrderCheck = Schemas["OrderCheckDoc"];
export type Order = Schemas["OrderKept"]["order"];

/** In the order in which a check shows them. */
export const ORDERS: readonly Order[] = ["high-high", "high-low", "low-high", "low-low"];

const EVERY_MS = 500;

export const useLines = () =>
  useQuery({
    queryKey: ["bus", "lines"],
    queryFn: ({ signal }) => get<Line[]>("/api/live/bus/lines", signal),
    refetchInterval: EVERY_MS,
    staleTime: 0,
    gcTime: 0,
    retry: false,
  });

const order = (slug: string) => `/api/live/devices/${slug}/order`;

export const useCheckOrder = (slug: string) =>
  useMutation({ mutationFn: () => send<OrderCheck>("POST", `${order(slug)}/check`, {}) });

export function useKeepOrder(slug: string) {
  const client = useQueryClient();
  return useMutation({
    mutationFn: (kept: Order) => send<OrderCheck>("POST", `${order(slug)}/keep`, { order: kept }),
    onSuccess: () => client.invalidateQueries({ queryKey: ["settings"] }),
  });
}
