/** Named views of plots, kept by the server for each person. */
import { queryOptions } from "@tanstack/react-query";
import { get, send } from "./client";
import type { components } from "./generated";

export type DeskView = components["schemas"]["DeskView"];
type DeskViews = components["schemas"]["DeskViews"];

const PATH = "/api/desk/views";

export const viewsQuery = queryOptions({
  queryKey: ["desk", "views"],
  queryFn: async ({ signal }) => (await get<DeskViews>(PATH, signal)).views,
});

export const putViews = async (views: readonly DeskView[]): Promise<DeskView[]> =>
  (await send<DeskViews>("PUT", PATH, { views })).views;
