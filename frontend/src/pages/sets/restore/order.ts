/** What a restore is asked for with, as the URL has it, and the plan that comes of it. */
import { keepPreviousData, useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { planQuery, type PlanDoc, type PlanRequest } from "../../../api/restore";
import { turbineQuery } from "../../../api/queries";
import { setsQuery } from "../../../api/sets";
import type { StationRef } from "../../../api/types";
import { usePageSearch } from "../../../frame/search";
import { placesOf } from "../../../ui/devices";
import { useTexts } from "../../../texts/texts";
import { useContexts } from "../../parameters/devicesOf";
import { linesOf, type PlanLine, selectedIn } from "./plan";

/** What a person ticks besides the objects. */
export interface Terms {
  restart: boolean;
  /** Restored as an expert: with what only the maker sets, and the two below. */
  expert: boolean;
  othersConfirmed: boolean;
  accepted: readonly string[];
  /** What decides at which address a device is found goes along. */
  network: boolean;
}

export const NO_TERMS: Terms = {
  restart: true,
  expert: false,
  othersConfirmed: false,
  accepted: [],
  network: false,
};

export const setsIn = (text: string | undefined): string[] => (text ?? "").split(",").filter(Boolean);

/** The station that is restored: the one in the URL, else that of the first set, where it is connected. */
export function useStation(): StationRef | undefined {
  const [search] = usePageSearch();
  const stations = useQuery(turbineQuery).data?.stations;
  const records = useQuery(setsQuery).data?.records;
  const first = records?.find((one) => one.id === setsIn(search.sets)[0]);
  const slug = search.station ?? first?.origin.device.split("/").slice(0, -1).join("/");
  return stations?.find((one) => one.slug === slug);
}

export function useOrder(terms: Terms): PlanRequest | null {
  const [search] = usePageSearch();
  const station = useStation();
  const order = useMemo(() => {
    const sets = setsIn(search.sets);
    if (!station || sets.length === 0) return null;
    const devices = station.devices.map((one) => one.slug);
    return {
      station: station.slug,
      sets,
      selected: selectedIn(search.select, devices),
      restart: terms.restart,
      expert: terms.expert,
      other_blades_confirmed: terms.othersConfirmed,
      accepted: [...terms.accepted],
      network: terms.network,
    };
  }, [station, search.sets, search.select, terms]);
  return order;
}

export interface Planned {
  plan: PlanDoc | undefined;
  lines: PlanLine[];
  /** The plan on show is of another order than the one that is asked for now. */
  outdated: boolean;
  reading: boolean;
  error: unknown;
  readAgain: () => void;
}

export function usePlan(order: PlanRequest | null): Planned {
  const t = useTexts();
  const turbine = useQuery(turbineQuery).data;
  const places = useMemo(() => placesOf(turbine ?? undefined), [turbine]);
  const contexts = useContexts(places);
  const query = useQuery({ ...planQuery(order), placeholderData: keepPreviousData });
  const plan = query.data;
  const lines = useMemo(() => {
    const nameOf = (slug: string) => places.find(({ device }) => device.slug === slug)?.device.name ?? slug;
    return plan ? linesOf(plan, { t, contexts, nameOf }) : [];
  }, [plan, t, contexts, places]);
  return {
    plan,
    lines,
    outdated: query.isPlaceholderData || query.isFetching,
    reading: query.isFetching,
    error: query.error,
    readAgain: () => void query.refetch(),
  };
}
