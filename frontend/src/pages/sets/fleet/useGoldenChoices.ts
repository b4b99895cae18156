import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { recordsQuery } from "../../../api/compare";
import { dateAndTime } from "../../../ui/format";
import { useFleetDevice } from "./deviceLabel";

/** The sets of this kind that could be held against the fleet, latest first. */
export function useGoldenChoices(kind: string): { value: string; label: string }[] {
  const nameOf = useFleetDevice();
  const records = useQuery({ ...recordsQuery(kind), enabled: kind !== "" }).data;
  return useMemo(
    () =>
      (records ?? []).map((one) => ({
        value: one.id,
        label: `${nameOf(one.origin.device)} · ${dateAndTime(one.t_ns / 1e6)}`,
      })),
    [records, nameOf],
  );
}
