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
 * `reason_keys` with several. Placeholders of such a text are filled likewise, its own name by the plain detail.
 */
const KEY_NAMES = /^(?:(\w+)_keys?|text_key_(\w+))$/;

function nested(texts: Readonly<Record<string, string>>, details: Details): Details {
  const first = words(texts, details, {});
  return { ...details, ...words(texts, details, first) };
}

/** The texts of all details that are keys, under both names; `others` fill their placeholders as well. */
function words(texts: Readonly<Record<string, string>>, details: Details, others: Details): Details {
  const found: Details = {};
  for (const [name, detail] of Object.entries(details)) {
    const match = KEY_NAMES.exec(name);
    const keys = typeof detail === "string" ? [detail] : Array.isArray(detail) ? (detail as unknown[]) : [];
    if (!match || keys.length === 0) continue;
    const own = match[1] ?? match[2] ?? name;
    const fillers: Details = { ...details, ...others, [own]: details[own] };
    const text = keys.map((key) => fill(texts[String(key)] ?? String(key), fillers)).join(", ");
    found[name] = text;
    found[own] ??= text;
  }
  return found;
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
