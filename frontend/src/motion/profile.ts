/**
 * The way of a blade to an angle in profile position mode: ramp up, constant speed, ramp down (manual 5.10: t = v / a).
 * Times in s, angles in degrees, speeds in degrees a second, ramps in degrees a second squared.
 */

export interface Ramps {
  speedDps: number;
  accelerationDps2: number;
  decelerationDps2: number;
}

export interface Profile {
  totalS: number;
  upS: number;
  steadyS: number;
  downS: number;
  /** The highest speed on the way: less than what was asked for where the way is too short for it. */
  peakDps: number;
}

/** Null where it cannot be told: no speed, or a ramp of 0. */
export function profileOf(distanceDeg: number, ramps: Ramps): Profile | null {
  const { speedDps, accelerationDps2: up, decelerationDps2: down } = ramps;
  if (!(speedDps > 0) || !(up > 0) || !(down > 0)) return null;
  const way = Math.abs(distanceDeg);
  const peakDps = Math.min(speedDps, Math.sqrt((2 * way * up * down) / (up + down)));
  const [upS, downS] = [peakDps / up, peakDps / down];
  const steadyS = peakDps > 0 ? Math.max(0, (way - (peakDps * (upS + downS)) / 2) / peakDps) : 0;
  return { totalS: upS + steadyS + downS, upS, steadyS, downS, peakDps };
}

/** How far of the way is done after `atS`, from 0 to 1. */
export function shareAt({ upS, steadyS, downS, totalS, peakDps }: Profile, atS: number): number {
  const whole = peakDps * ((upS + downS) / 2 + steadyS);
  if (whole === 0 || atS >= totalS) return 1;
  if (atS <= 0) return 0;
  if (atS < upS) return (peakDps * atS * atS) / (2 * upS) / whole;
  if (atS < upS + steadyS) return (peakDps * (upS / 2 + (atS - upS))) / whole;
  const left = totalS - atS;
  return 1 - (peakDps * left * left) / (2 * downS) / whole;
}
