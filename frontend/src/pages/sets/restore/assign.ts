/** Which of the chosen sets goes to which device of a station, as the server assigns them. */
import type { SetRecord } from "../../../api/types";
import type { DeviceRef } from "../../../api/types";

export interface Assigned {
  device: DeviceRef;
  /** What the device is to have; null leaves it as it is. */
  record: SetRecord | null;
  /** What it can have: its own sets first, then those of other devices of its kind, the latest first. */
  choices: SetRecord[];
}

/** A set of the very device goes to it, any other to the device of its kind. */
export function assign(
  devices: readonly DeviceRef[],
  records: readonly SetRecord[],
  sets: readonly string[],
): Assigned[] {
  const chosen = sets.flatMap((key) => records.find((one) => one.id === key) ?? []);
  const own = new Set(devices.flatMap((device) => chosen.filter((one) => one.origin.device === device.slug)));
  return devices.map((device) => {
    const choices = records.filter((one) => one.description_id === device.description_id);
    const mine = (one: SetRecord) => one.origin.device === device.slug;
    const fits = (one: SetRecord) => one.description_id === device.description_id && !own.has(one);
    return {
      device,
      record: chosen.find(mine) ?? chosen.find(fits) ?? null,
      choices: [...choices.filter(mine), ...choices.filter((one) => !mine(one))],
    };
  });
}

/** Sets that are not in the library, such as the values of a motor: they go along as they are. */
export const others = (records: readonly SetRecord[], sets: readonly string[]): string[] =>
  sets.filter((key) => !records.some((one) => one.id === key));

/** The chosen sets with another one for a device. */
export function exchange(sets: readonly string[], from: string | null, to: string | null): string[] {
  const rest = sets.filter((key) => key !== from && key !== to);
  return to === null ? rest : [...rest, to];
}
