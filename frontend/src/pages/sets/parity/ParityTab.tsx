import { SegmentedControl } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { LEAST_COLUMNS } from "../../../api/compare";
import { turbineQuery } from "../../../api/queries";
import { usePageSearch } from "../../../frame/search";
import { Unconnected } from "../../../frame/Unconnected";
import { useTexts } from "../../../texts/texts";
import { placesOf } from "../../../ui/devices";
import room from "../../../ui/Room.module.css";
import { type Kind, kindsOf } from "../../parameters/selection";
import { Comparison } from "../compare/Comparison";
import { Against } from "../compare/marks";
import { ofDevice, Source } from "../compare/specs";
import { BladeVerdicts } from "./BladeVerdicts";

const LABEL = { minHeight: 40, display: "flex", alignItems: "center", justifyContent: "center" };

/** The blades of the connected turbine side by side, live: they should be alike but for what is bound to one unit. */
export function ParityTab() {
  const t = useTexts();
  const [search] = usePageSearch();
  const turbine = useQuery(turbineQuery);
  const kinds = useMemo(
    () => kindsOf(placesOf(turbine.data)).filter((kind) => kind.places.length >= LEAST_COLUMNS),
    [turbine.data],
  );
  const kind =
    kinds.find((one) => one.places.some((place) => place.device.slug === search.device)) ?? kinds[0];
  if (turbine.isSuccess && !turbine.data) return <Unconnected />;
  if (!kind) return turbine.isSuccess ? <p className={room.note}>{t("page.parity.alone")}</p> : null;
  return (
    <Comparison
      key={kind.descriptionId}
      label={t("page.sets.tab.blades")}
      columns={kind.places.map((place) => ofDevice(Source.Live, place.device.slug))}
      against={Against.Majority}
      chooser={() => <KindPicker kinds={kinds} kind={kind} />}
      verdict={(compared) => <BladeVerdicts compared={compared} />}
    />
  );
}

function KindPicker({ kinds, kind }: { kinds: readonly Kind[]; kind: Kind }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const pick = (id: string) => {
    const next = kinds.find((one) => one.descriptionId === id);
    update({ device: next?.places[0]?.device.slug, group: undefined, edit: undefined });
  };
  return (
    <SegmentedControl
      aria-label={t("page.device.kind")}
      size="sm"
      styles={{ label: LABEL }}
      data={kinds.map((one) => ({ value: one.descriptionId, label: one.name }))}
      value={kind.descriptionId}
      onChange={pick}
      data-testid="parity-kind"
    />
  );
}
