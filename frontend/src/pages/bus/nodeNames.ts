/** Names of nodes by their number, as the connected turbine has them. */
import { useQuery } from "@tanstack/react-query";
import { useTurbineQuery } from "../../api/queries";
import { type Translate, useTexts } from "../../texts/texts";
import { placesOf, stationName } from "../../ui/devices";

export function useDeviceOfNode(): (node: number) => string | null {
  const t = useTexts();
  const turbine = useQuery(useTurbineQuery()).data;
  const places = placesOf(turbine ?? undefined);
  return (node) => {
    const place = places.find((one) => one.device.node === node);
    return place ? `${stationName(place.station, t)} ${place.device.name}` : null;
  };
}

/** `11 Blade 1 PMC`, `7`, or that it belongs to no node. */
export function placeName(node: number, deviceOf: (node: number) => string | null, t: Translate): string {
  if (node === 0) return t("trace.load.of_none");
  return [String(node), deviceOf(node)].filter(Boolean).join(" ");
}
