/** Words for what went wrong: what happened, what state the device is in, what to do next. */
import { Problem } from "../api/client";
import type { Details } from "../api/types";
import type { Translate } from "../texts/texts";

export interface Story {
  happened: string;
  state: string | null;
  next: string;
  /** For the maker or the phone: names and values, abort codes in hexadecimal. */
  details: [string, string][];
}

export function storyOf(error: unknown, t: Translate): Story {
  if (!(error instanceof Problem)) {
    return {
      happened: t("page.error.unreachable"),
      state: null,
      next: t("page.next.unreachable"),
      details: [],
    };
  }
  const { code, text_key, details, device_state: state, title } = error.doc;
  const next = `page.next.${code}`;
  return {
    happened: t.has(text_key) ? t(text_key, details) : title,
    state: state === null ? null : t(state),
    next: t(t.has(next) ? next : "page.next.other"),
    details: [["code", code], ...detailPairs(details)],
  };
}

export function detailPairs(details: Details): [string, string][] {
  return Object.entries(details).map(([name, detail]) => [name, detailText(name, detail)]);
}

function detailText(name: string, detail: unknown): string {
  if (name === "abort_code" && typeof detail === "number") {
    return `${(detail >>> 0).toString(16).toUpperCase().padStart(8, "0")}h`;
  }
  return typeof detail === "string" ? detail : JSON.stringify(detail);
}
