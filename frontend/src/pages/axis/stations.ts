/** The stations that the room is about: those of blades, and others where one of the devices is an axis. */
import type { StationRef } from "../../api/types";
import { lastOf } from "../../ui/format";

/** As the URL names a station: the number of its blade, else its own part of the slug. */
export const keyOf = (station: StationRef) =>
  station.blade === null ? lastOf(station.slug) : String(station.blade);

export const hasAxis = ({ blade, devices }: StationRef) => blade !== null || devices.some((one) => one.axis);
