/** Which devices the room shows: one, or all of its kind side by side. */
import type { Place } from "../../ui/devices";

export interface Kind {
  descriptionId: string;
  name: string;
  places: Place[];
}

/** Devices of one description, in the order of the site file. */
export function kindsOf(places: readonly Place[]): Kind[] {
  const kinds = new Map<string, Kind>();
  for (const place of places) {
    const id = place.device.description_id;
    const kind = kinds.get(id) ?? { descriptionId: id, name: place.device.name, places: [] };
    kind.places.push(place);
    kinds.set(id, kind);
  }
  return [...kinds.values()];
}

export interface Selection {
  kind: Kind;
  /** The device that the editor and the dialogs mean. */
  active: Place;
  side: boolean;
}

/** The device of the URL, or the first; side by side only where there is more than one of the kind. */
export function selectionOf(
  places: readonly Place[],
  slug: string | undefined,
  view: "side" | undefined,
): Selection | null {
  const active = places.find((one) => one.device.slug === slug) ?? places[0];
  if (!active) return null;
  const kind = kindsOf(places).find((one) => one.descriptionId === active.device.description_id);
  if (!kind) return null;
  return { kind, active, side: view === "side" && kind.places.length > 1 };
}

/** The place of another kind beside this one: the same station where it has such a device. */
export function besideOf(kind: Kind, active: Place): Place | undefined {
  return kind.places.find((one) => one.station.slug === active.station.slug) ?? kind.places[0];
}
