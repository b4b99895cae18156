/** The string of blocs as a picture shows it: how full each one is, which is the least and which the greatest. */

export interface BlocReading {
  number: number;
  mv: number | null;
  tenthsC: number | null;
}

export interface Bloc extends BlocReading {
  /** 0 empty to 1 full, by its voltage; null where that is not known. */
  fill: number | null;
  least: boolean;
  greatest: boolean;
}

/** What a unit shows for a bloc that tells no temperature (manual 4.6.2.4). */
export const NO_SENSOR = 32767;
/** Blocs that differ by less are alike: 3061h is read one after another. */
export const ALIKE_MV = 20;
/** A bloc is empty at this share of its nominal voltage. */
const EMPTY_SHARE = 0.86;

/** Marks the extremes where they differ by more than measuring does; limits in mV of one bloc. */
export function blocsOf(readings: readonly BlocReading[], nominalMv: number, greatestMv: number): Bloc[] {
  const known = readings.map((one) => one.mv).filter((mv): mv is number => mv !== null && mv > 0);
  const [low, high] = [Math.min(...known), Math.max(...known)];
  const differ = known.length > 1 && high - low > ALIKE_MV;
  const emptyMv = nominalMv * EMPTY_SHARE;
  return readings.map((one) => ({
    ...one,
    fill:
      one.mv === null || greatestMv <= emptyMv
        ? null
        : Math.min(1, Math.max(0, (one.mv - emptyMv) / (greatestMv - emptyMv))),
    least: differ && one.mv === low,
    greatest: differ && one.mv === high,
  }));
}

export enum Flow {
  Charges = "charges",
  Discharges = "discharges",
  Rests = "rests",
  Unknown = "unknown",
}

/** Which way the current of 3070h flows: positive discharges (manual 4.3.2.11). */
export function flowOf(currentMa: number | null): Flow {
  if (currentMa === null) return Flow.Unknown;
  if (currentMa === 0) return Flow.Rests;
  return currentMa > 0 ? Flow.Discharges : Flow.Charges;
}

export enum ChargeStage {
  Off = "off",
  Current = "current",
  Voltage = "voltage",
  Full = "full",
}

const [ACTIVE, CONSTANT_CURRENT, CONSTANT_VOLTAGE] = [1 << 1, 1 << 2, 1 << 3];

/** Where the charger stands by 3001h; at rest it is full while the voltage without load is above where it recharges. */
export function stageOf(
  status: number | null,
  offLoadV: number | null,
  rechargeV: number | null,
): ChargeStage | null {
  if (status === null) return null;
  if (status & CONSTANT_CURRENT) return ChargeStage.Current;
  if (status & CONSTANT_VOLTAGE) return ChargeStage.Voltage;
  if (status & ACTIVE) return ChargeStage.Current;
  return offLoadV !== null && rechargeV !== null && offLoadV >= rechargeV
    ? ChargeStage.Full
    : ChargeStage.Off;
}

/** Points of a curve in a box; gaps where nothing was measured are left out. */
export function curve(
  values: readonly (number | null)[],
  timesMs: readonly number[],
  box: { width: number; height: number; low: number; high: number; untilMs: number },
): string {
  const span = box.high - box.low || 1;
  return values
    .flatMap((value, at) =>
      value === null
        ? []
        : [
            `${(((timesMs[at] ?? 0) / Math.max(box.untilMs, 1)) * box.width).toFixed(1)},${(
              box.height -
              ((value - box.low) / span) * box.height
            ).toFixed(1)}`,
          ],
    )
    .join(" ");
}

/** The bloc that was lowest in a course, from 1, and its voltage; null where no bloc was measured. */
export function weakest(
  course: readonly { blocs_mv: readonly (number | null)[] }[],
): { number: number; mv: number } | null {
  let found: { number: number; mv: number } | null = null;
  for (const { blocs_mv: blocs } of course)
    blocs.forEach((mv, at) => {
      if (mv !== null && mv > 0 && (found === null || mv < found.mv)) found = { number: at + 1, mv };
    });
  return found;
}
