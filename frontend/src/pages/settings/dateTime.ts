import type { Language } from "../../api/types";
import { timeOfDay } from "../../ui/format";

const two = (number: number) => String(number).padStart(2, "0");

/** `2026-11-22 14:03:22`, or `22.11.2026 14:03:22` in German; local time of the browser. */
export function dateTime(ms: number, language: Language): string {
  const at = new Date(ms);
  const [day, month, year] = [two(at.getDate()), two(at.getMonth() + 1), String(at.getFullYear())];
  const date = language === "de" ? `${day}.${month}.${year}` : `${year}-${month}-${day}`;
  return `${date} ${timeOfDay(ms, 0)}`;
}
