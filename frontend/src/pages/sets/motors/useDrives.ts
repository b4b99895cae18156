import { useQuery } from "@tanstack/react-query";
import type { MotorForm } from "../../../api/motors";
import { turbineQuery } from "../../../api/queries";
import { useLink } from "../../../live/live";
import { useTexts } from "../../../texts/texts";
import { placesOf, stationName } from "../../../ui/devices";

/** The drives of the connected turbine that have a motor, for a choice; none where nothing is connected. */
export function useDrives(form: MotorForm): { value: string; label: string }[] {
  const t = useTexts();
  const turbine = useQuery(turbineQuery).data;
  const connected = useLink()?.state === "connected";
  if (!connected) return [];
  return placesOf(turbine)
    .filter(({ device }) => device.description_id === form.description.id)
    .map(({ station, device }) => ({
      value: device.slug,
      label: `${stationName(station, t)} ${device.name} (${device.slug})`,
    }));
}
