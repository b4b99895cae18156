import { useQuery } from "@tanstack/react-query";
import { useCallback } from "react";
import { turbineQuery } from "../../../api/queries";
import { useTexts } from "../../../texts/texts";
import { stationName } from "../../../ui/devices";
import { lastOf } from "../../../ui/format";

/** Names a station by its slug as people say it: "Blade 2"; the end of the slug where it is not connected. */
export function useStationName(): (slug: string) => string {
  const t = useTexts();
  const turbine = useQuery(turbineQuery).data;
  return useCallback(
    (slug) => {
      const station = turbine?.stations.find((one) => one.slug === slug);
      return station ? stationName(station, t) : lastOf(slug);
    },
    [turbine, t],
  );
}
