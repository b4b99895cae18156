/** Moments of a recording in words: date, milliseconds and zone, in the local time of the browser. */
import { timeOfDay } from "../ui/format";

const two = (number: number) => String(number).padStart(2, "0");

export function dateText(ms: number): string {
  const at = new Date(ms);
  return `${at.getFullYear()}-${two(at.getMonth() + 1)}-${two(at.getDate())}`;
}

/** `UTC`, `UTC+2`, `UTC−3:30`: of that moment, for summer time comes and goes. */
export function zoneText(ms: number): string {
  const minutes = -new Date(ms).getTimezoneOffset();
  if (minutes === 0) return "UTC";
  const [hours, rest] = [Math.floor(Math.abs(minutes) / 60), Math.abs(minutes) % 60];
  return `UTC${minutes < 0 ? "−" : "+"}${hours}${rest === 0 ? "" : `:${two(rest)}`}`;
}

/** Label of a tick: no finer than the ticks are apart. */
export function tickText(tNs: number, stepS: number): string {
  const ms = tNs / 1e6;
  if (stepS >= 86_400) return dateText(ms);
  if (stepS < 0.001) return `${timeOfDay(ms).slice(6)}${String(Math.round(tNs / 1e5) % 10)}`;
  if (stepS < 1) return timeOfDay(ms).slice(3);
  return stepS >= 60 ? timeOfDay(ms, 0).slice(0, 5) : timeOfDay(ms, 0);
}
