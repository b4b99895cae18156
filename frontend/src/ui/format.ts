import type { Language } from "../api/types";
import { figure } from "../model/values";

const two = (number: number) => String(number).padStart(2, "0");

/** `00:14:22` of a duration. */
export function clock(durationMs: number): string {
  const seconds = Math.max(0, Math.floor(durationMs / 1000));
  return `${two(Math.floor(seconds / 3600))}:${two(Math.floor(seconds / 60) % 60)}:${two(seconds % 60)}`;
}

/** `14:03:22.118` of a moment, in the local time of the browser. */
export function timeOfDay(ms: number, decimals: 0 | 3 = 3): string {
  const at = new Date(ms);
  const plain = `${two(at.getHours())}:${two(at.getMinutes())}:${two(at.getSeconds())}`;
  return decimals === 0 ? plain : `${plain}.${String(at.getMilliseconds()).padStart(3, "0")}`;
}

/** `2026-11-22 14:03` of a moment, in the local time of the browser. */
export function dateAndTime(ms: number): string {
  const at = new Date(ms);
  const day = `${at.getFullYear()}-${two(at.getMonth() + 1)}-${two(at.getDate())}`;
  return `${day} ${two(at.getHours())}:${two(at.getMinutes())}`;
}

/** `0.3 s`, `45 s`, `12 min`, `3.2 h` of an age. */
export function age(ageMs: number, language: Language): string {
  const seconds = Math.max(0, ageMs / 1000);
  if (seconds < 10) return `${figure(seconds, 1, language)} s`;
  if (seconds < 120) return `${figure(seconds, 0, language)} s`;
  if (seconds < 7200) return `${figure(seconds / 60, 0, language)} min`;
  return `${figure(seconds / 3600, 1, language)} h`;
}

export function megabytes(bytes: number, language: Language): string {
  return `${figure(bytes / 1e6, 1, language)} MB`;
}

/** An error code as the manuals print it: `3284h`. */
export function errorCode(code: number): string {
  return `${code.toString(16).toUpperCase().padStart(4, "0")}h`;
}

/** `wtg-07/blade-2/pmc` without the turbine, as people say it: the names of station and device. */
export function lastOf(slug: string): string {
  return slug.split("/").slice(1).join(" ");
}

/** `2026-11-22 04:31:26` of a moment, in the local time of the browser: sorts as it reads, the same in every language. */
export function dayAndTime(ms: number): string {
  const at = new Date(ms);
  return `${at.getFullYear()}-${two(at.getMonth() + 1)}-${two(at.getDate())} ${timeOfDay(ms, 0)}`;
}

/** Bytes in the unit that reads best: `512 B`, `6.1 kB`, `41.3 MB`, `1.2 GB`. */
export function bytes(count: number, language: Language): string {
  if (count < 1000) return `${count} B`;
  if (count < 1e6) return `${figure(count / 1e3, 1, language)} kB`;
  if (count < 1e9) return megabytes(count, language);
  return `${figure(count / 1e9, 1, language)} GB`;
}
