import { useQuery } from "@tanstack/react-query";
import { useCallback } from "react";
import { useTurbineQuery } from "../api/queries";
import type { DeviceRef, StationRef, Turbine } from "../api/types";
import { type Translate, useTexts } from "../texts/texts";
import { lastOf } from "./format";

export interface Place {
  station: StationRef;
  device: DeviceRef;
}

export function placesOf(turbine: Turbine | undefined): Place[] {
  return (turbine?.stations ?? []).flatMap((station) =>
    station.devices.map((device) => ({ station, device })),
  );
}

export function stationName(station: StationRef, t: Translate): string {
  return station.blade === null ? station.name : t("page.blade", { blade: station.blade });
}

/** Names a device by its slug as people say it: "Blade 2 PMC"; the end of the slug where it is not known. */
export function useDeviceName(): (slug: string) => string {
  const t = useTexts();
  const turbine = useQuery(useTurbineQuery()).data;
  return useCallback(
    (slug) => {
      const place = placesOf(turbine).find((one) => one.device.slug === slug);
      return place ? `${stationName(place.station, t)} ${place.device.name}` : lastOf(slug);
    },
    [turbine, t],
  );
}
