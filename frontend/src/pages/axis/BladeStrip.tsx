import { SegmentedControl } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import type { ReactNode } from "react";
import { useTurbineQuery } from "../../api/queries";
import type { StationRef } from "../../api/types";
import { usePageSearch } from "../../frame/search";
import { Unconnected } from "../../frame/Unconnected";
import { useTexts } from "../../texts/texts";
import { stationName } from "../../ui/devices";
import { hasAxis, keyOf } from "./stations";
import room from "../../ui/Room.module.css";

interface Props {
  /** What stands beside the choice. */
  now?: (station: StationRef) => ReactNode;
  children: (station: StationRef) => ReactNode;
  /** Stations without a blade are offered too, where one of their devices is an axis. */
  benches?: boolean;
}

/** The blade that a tab of this room is about, chosen in the strip at its head. */
export function BladeStrip({ now, children, benches = false }: Props) {
  const t = useTexts();
  const query = useQuery(useTurbineQuery());
  const turbine = query.data;
  const [search, update] = usePageSearch();
  const stations = (turbine?.stations ?? []).filter((one) => one.blade !== null || (benches && hasAxis(one)));
  const station = stations.find((one) => keyOf(one) === search.blade) ?? stations[0];
  if (!turbine) return query.isSuccess ? <Unconnected /> : null;
  if (!station) return <p className={room.note}>{t(benches ? "page.axis.no_axis" : "page.axis.none")}</p>;
  return (
    <>
      <div className={room.strip}>
        <h1>{t("page.rooms.axis")}</h1>
        <SegmentedControl
          value={keyOf(station)}
          onChange={(blade) => update({ blade })}
          data={stations.map((one) => ({ value: keyOf(one), label: stationName(one, t) }))}
          aria-label={t(station.blade === null ? "page.axis.choose_axis" : "page.axis.choose")}
          data-testid="choose-blade"
        />
        {now?.(station)}
      </div>
      {children(station)}
    </>
  );
}
