import { SegmentedControl, Select } from "@mantine/core";
import { useTexts } from "../../texts/texts";
import { type Place, stationName } from "../../ui/devices";

/** As many buttons side by side still fit beside the 3D view. */
const MOST_BUTTONS = 6;

interface Props {
  places: readonly Place[];
  value: string | null;
  onPick: (slug: string) => void;
}

export function DevicePicker({ places, value, onPick }: Props) {
  const t = useTexts();
  const data = places.map(({ station, device }) => ({
    value: device.slug,
    label: `${stationName(station, t)} ${device.name}`,
  }));
  const label = t("page.device.pick");
  if (data.length > MOST_BUTTONS) {
    return (
      <Select
        aria-label={label}
        data-testid="device"
        data={data}
        value={value}
        allowDeselect={false}
        onChange={(slug) => slug !== null && onPick(slug)}
      />
    );
  }
  return (
    <SegmentedControl
      aria-label={label}
      data-testid="device"
      data={data}
      value={value ?? ""}
      onChange={onPick}
      size="sm"
      styles={{ label: { minHeight: 40, display: "flex", alignItems: "center", justifyContent: "center" } }}
    />
  );
}
