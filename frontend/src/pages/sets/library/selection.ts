/** The sets that are picked, by id, as they stand in the URL. */
import type { SetRecord } from "../../../api/types";
import type { PageSearch } from "../../../frame/search";

export const pickedOf = (search: PageSearch): string[] => (search.sets ?? "").split(",").filter(Boolean);

export function toggled(picked: readonly string[], id: string): string | undefined {
  const now = picked.includes(id) ? picked.filter((one) => one !== id) : [...picked, id];
  return now.length === 0 ? undefined : now.join(",");
}

/** What a comparison shows of these sets; one alone is put beside the device as it is now. */
export function columnsOf(records: readonly SetRecord[]): string {
  const sets = records.map((one) => `set:${one.id}`);
  const [only] = records;
  return (records.length === 1 && only ? [...sets, `live:${only.origin.device}`] : sets).join(",");
}

/** `wtg-07/blade-2` of `wtg-07/blade-2/pmc`. */
export const stationOf = (device: string) => device.split("/").slice(0, -1).join("/");

/** The station whose devices the sets are of, one each; null where they do not make one restore. */
export function restorable(records: readonly SetRecord[]): string | null {
  const kinds = new Set(records.map((one) => one.description_id));
  const stations = new Set(records.map((one) => stationOf(one.origin.device)));
  const [station] = stations;
  return records.length > 0 && stations.size === 1 && kinds.size === records.length && station
    ? station
    : null;
}
