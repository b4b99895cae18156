/** What is typed for a test signal: defaults, and what follows from it. The server holds to the limits. */
import type { SignalLine, SignalSettings } from "../../../api/signals";
import { figure } from "../../../model/values";
import type { Translate } from "../../../texts/texts";

export type Shape = SignalSettings["shape"];

export const SHAPES: readonly Shape[] = ["sine", "step", "ramp"];

/** Towards 0 degrees: away from the 90 degree switch, which ends a motion. */
export const USUAL: Readonly<Record<Shape, SignalSettings>> = {
  sine: { shape: "sine", amplitude_deg: -1, frequency_hz: 0.5, cycles: 3, speed_dps: 2, hold_s: 1 },
  step: { shape: "step", amplitude_deg: -0.5, frequency_hz: 0.5, cycles: 1, speed_dps: 5, hold_s: 1 },
  ramp: { shape: "ramp", amplitude_deg: -3, frequency_hz: 0.5, cycles: 1, speed_dps: 2, hold_s: 1 },
};

const REST_S = 0.5;
const CORNER_S = 0.25;
const FADE_S = 0.5;

/** How long a signal takes in s; as the server makes it. */
export function durationS(signal: SignalSettings): number {
  const { shape, amplitude_deg, frequency_hz, cycles, speed_dps, hold_s } = signal;
  if (shape === "sine") return 2 * REST_S + 2 * Math.max(1 / frequency_hz, FADE_S) + cycles / frequency_hz;
  const wayS = shape === "ramp" ? Math.abs(amplitude_deg) / speed_dps + CORNER_S : 0;
  return 2 * REST_S + cycles * 2 * (wayS + hold_s);
}

/** Lowest and highest angle of a signal that begins at `startDeg`. */
export function reach(signal: SignalSettings, startDeg: number): [number, number] {
  const ends = [
    startDeg + signal.amplitude_deg,
    signal.shape === "sine" ? startDeg - signal.amplitude_deg : startDeg,
  ];
  return [Math.min(...ends), Math.max(...ends)];
}

/** `Sine 1.00°, 0.50 Hz`. */
export function nameOf(line: Pick<SignalLine, "signal">, t: Translate): string {
  const { signal } = line;
  const at =
    signal.shape === "sine"
      ? `${figure(signal.frequency_hz, 2, t.language)} Hz`
      : `${figure(signal.speed_dps, 1, t.language)} °/s`;
  return `${t(`page.signal.shape.${signal.shape}`)} ${figure(signal.amplitude_deg, 2, t.language)}°, ${at}`;
}
