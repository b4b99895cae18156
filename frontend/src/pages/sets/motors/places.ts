/** What the `motor` and `columns` of the address name, in the tab of motors. */
import type { Assigned, Motor, MotorList } from "../../../api/motors";

export const NEW = "new";
export const FROM_DEVICE = "from-device";

const UUID = /^[0-9a-f-]{36}$/;

/** `ID` or `ID@VERSION`. */
export function placeOf(text: string): { id: string; version: number | null } {
  const [id = "", version] = text.split("@");
  return { id, version: version !== undefined && /^\d+$/.test(version) ? Number(version) : null };
}

export const titleOf = (motor: Motor): string => `${motor.maker} ${motor.type}`;

/** How a comparison names a motor. */
export const specOf = (motor: Pick<Motor, "id">): string => `motor:${motor.id}`;
export const liveSpec = (slug: string): string => `live:${slug}`;

/** The id of the motor that a side of a comparison names; undefined where it names a device. */
export function idOf(spec: string): string | undefined {
  const { id } = placeOf(spec.replace(/^motor:/, ""));
  return UUID.test(id) ? id : undefined;
}

/** The two sides that the address names; "" where none is chosen yet. */
export function sidesOf(columns: string | undefined): [string, string] {
  const [left = "", right = ""] = (columns ?? "").split(",");
  return [left, right];
}

/** Devices that drive a motor, as far as somebody has said. */
export const devicesOf = (list: MotorList, id: string): Assigned[] =>
  list.assigned.filter((one) => one.motor_id === id);
