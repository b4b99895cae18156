import { SegmentedControl } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import type { ReactNode } from "react";
import { useTurbineQuery } from "../../api/queries";
import type { StationRef } from "../../api/types";
import { usePageSearch } from "../../frame/search";
import { Unconnected } from "../../frame/Unconnected";
import { useTexts } from "../../texts/texts";
import { stationName } from "../../ui/devices";
import room from "../../ui/Room.module.css";

interface Props {
  /** What stands beside the choice. */
  now?: (station: StationRef) => ReactNode;
  children: (station: StationRef) => ReactNode;
}

/** The blade that a tab of this room is about, chosen in the strip at its head. */
export function BladeStrip({ now, children }: Props) {
  const t = useTexts();
  const query = useQuery(useTurbineQuery());
  const turbine = query.data;
  const [search, update] = usePageSearch();
  const stations = (turbine?.stations ?? []).filter((station) => station.blade !== null);
  const station = stations.find((one) => String(one.blade) === search.blade) ?? stations[0];
  if (!turbine) return query.isSuccess ? <Unconnected /> : null;
  if (!station) return <p className={room.note}>{t("page.axis.none")}</p>;
  return (
    <>
      <div className={room.strip}>
        <h1>{t("page.rooms.axis")}</h1>
        <SegmentedControl
          value={String(station.blade)}
          onChange={(blade) => update({ blade })}
          data={stations.map((one) => ({ value: String(one.blade), label: stationName(one, t) }))}
          aria-label={t("page.axis.choose")}
          data-testid="choose-blade"
        />
        {now?.(station)}
      </div>
      {children(station)}
    </>
  );
}
