/** The catalogue of texts: keys to texts with {placeholders}, from the server; `boot` holds the few needed before it. */
import { createContext, useContext } from "react";
import boot from "virtual:boot-texts";
import type { Details, Language } from "../api/types";

export interface Translate {
  (key: string, details?: Details): string;
  /** Translation of an object's English name; that name where there is none. */
  nameOf: (english: string) => string;
  has: (key: string) => boolean;
  language: Language;
}

const DASH = "–";

export function translator(texts: Readonly<Record<string, string>>, language: Language): Translate {
  const t = (key: string, details: Details = {}): string => fill(texts[key] ?? key, nested(texts, details));
  return Object.assign(t, {
    // An entry of an array is called after both: "drive data: min DC link voltage".
    nameOf: (english: string) =>
      texts[`name.${english}`] ??
      english
        .split(": ")
        .map((part) => texts[`name.${part}`] ?? part)
        .join(": "),
    has: (key: string) => key in texts,
    language,
  });
}

export const bootTranslator = (language: Language): Translate => translator(boot[language] ?? {}, language);

/**
 * Details that are keys themselves: `reason_key` and `text_key_reason` both fill the placeholder `reason` with a text,
 * whose own placeholders are filled likewise.
 */
const KEY_NAMES = /^(?:(\w+)_key|text_key_(\w+))$/;

function nested(texts: Readonly<Record<string, string>>, details: Details): Details {
  const filled: Details = { ...details };
  for (const [name, detail] of Object.entries(details)) {
    const match = KEY_NAMES.exec(name);
    if (!match || typeof detail !== "string") continue;
    const text = fill(texts[detail] ?? detail, details);
    filled[name] = text;
    filled[match[1] ?? match[2] ?? name] ??= text;
  }
  return filled;
}

/** A placeholder without a detail becomes a dash, as on the server. */
function fill(text: string, details: Details): string {
  return text.replaceAll(/\{(\w+)\}/g, (_all, name: string) => plain(details[name]));
}

function plain(detail: unknown): string {
  if (detail === null || detail === undefined) return DASH;
  return typeof detail === "string" ? detail : JSON.stringify(detail);
}

export const TextsContext = createContext<Translate | null>(null);

export function useTexts(): Translate {
  const t = useContext(TextsContext);
  if (!t) throw new Error("no texts around this component");
  return t;
}
