import { SegmentedControl, Select } from "@mantine/core";
import { useTexts } from "../../texts/texts";
import { type Place, stationName } from "../../ui/devices";
import classes from "./Parameters.module.css";
import { besideOf, kindsOf, type Selection } from "./selection";

/** As many buttons side by side still fit beside the 3D view. */
const MOST_BUTTONS = 6;
const SIDE = "side";
const LABEL = { minHeight: 40, display: "flex", alignItems: "center", justifyContent: "center" };

interface Props {
  places: readonly Place[];
  selection: Selection;
  onPick: (slug: string, side: boolean) => void;
}

/** First what kind of device, then of which blade, or of all side by side. */
export function DevicePicker({ places, selection, onPick }: Props) {
  const t = useTexts();
  const { kind, active, side } = selection;
  const kinds = kindsOf(places);
  const several = kind.places.length > 1;
  const pickKind = (id: string) => {
    const next = kinds.find((one) => one.descriptionId === id);
    const place = next && besideOf(next, active);
    if (place) onPick(place.device.slug, side);
  };
  const pickDevice = (slug: string) =>
    slug === SIDE ? onPick(active.device.slug, true) : onPick(slug, false);
  return (
    <div className={classes.pickers}>
      {kinds.length > 1 && (
        <Choice
          label={t("page.device.kind")}
          testId="kind"
          data={kinds.map((one) => ({ value: one.descriptionId, label: one.name }))}
          value={kind.descriptionId}
          onPick={pickKind}
        />
      )}
      <Choice
        label={t("page.device.pick")}
        testId="device"
        data={[
          ...kind.places.map(({ station, device }) => ({
            value: device.slug,
            label: stationName(station, t),
          })),
          ...(several ? [{ value: SIDE, label: t("page.device.side") }] : []),
        ]}
        value={side ? SIDE : active.device.slug}
        onPick={pickDevice}
      />
    </div>
  );
}

interface ChoiceProps {
  label: string;
  testId: string;
  data: { value: string; label: string }[];
  value: string;
  onPick: (value: string) => void;
}

function Choice({ label, testId, data, value, onPick }: ChoiceProps) {
  if (data.length > MOST_BUTTONS) {
    return (
      <Select
        aria-label={label}
        data-testid={testId}
        data={data}
        value={value}
        allowDeselect={false}
        onChange={(picked) => picked !== null && onPick(picked)}
      />
    );
  }
  return (
    <SegmentedControl
      aria-label={label}
      data-testid={testId}
      data={data}
      value={value}
      onChange={onPick}
      size="sm"
      styles={{ label: LABEL }}
    />
  );
}
