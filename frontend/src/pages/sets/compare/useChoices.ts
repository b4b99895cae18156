/** The choices of the picker, from the connected turbine and the library. */
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { turbineQuery } from "../../../api/queries";
import { useTexts } from "../../../texts/texts";
import { placesOf, stationName } from "../../../ui/devices";
import { type Choice, deviceChoices } from "./choices";
import { deviceOf, type Source } from "./specs";

/** `kind`: only devices and sets of this description; all where it is null. `reference`: the first column. */
export function useChoices(kind: string | null, reference: string | null): Choice[] {
  const t = useTexts();
  const turbine = useQuery(turbineQuery).data;
  return useMemo(() => {
    const devices = placesOf(turbine ?? undefined)
      .map(({ station, device }) => ({
        slug: device.slug,
        name: `${stationName(station, t)} ${device.name}`,
        descriptionId: device.description_id,
        connected: true,
      }))
      .filter((one) => kind === null || one.descriptionId === kind);
    const words = {
      source: (source: Source) => t(`page.compare.source.${source}`),
      hint: (source: Source) => t(`page.compare.hint.${source}`),
    };
    return deviceChoices(devices, reference === null ? null : deviceOf(reference), words);
  }, [turbine, kind, reference, t]);
}
