/** What is about to be injected: texts as typed (they live in the URL), and the order that they make. */
import type { FaultKind, FaultOrder, FaultParameter } from "../../api/instructor";
import type { Language } from "../../api/types";
import { localise } from "../../model/values";

/** Name of the duration among the typed texts. */
export const FOR = "for";
const LEAST_S = 0.1;
const MOST_S = 86_400;
/** Numbers that people know in hexadecimal: identifiers and addresses of objects. */
const HEXADECIMAL = new Set(["first_id", "last_id", "can_id", "index", "sub"]);
const HEX = /^(?:0x([0-9a-f]+)|([0-9a-f]+)h)$/i;
const DECIMAL = /^[-+]?\d+(?:[.,]\d+)?$/;

/** How long a fault lasts; unlike other values it may be left out. */
export const DURATION: FaultParameter = {
  name: FOR,
  unit: "s",
  low: LEAST_S,
  high: MOST_S,
  default: 0,
  integer: false,
};

export type Typed = ReadonlyMap<string, string>;

/** `percent:30;for:10` as texts by name. */
export function typedOf(text: string): Map<string, string> {
  const pairs = text.split(";").flatMap((part): [string, string][] => {
    const at = part.indexOf(":");
    return at < 1 ? [] : [[part.slice(0, at), part.slice(at + 1)]];
  });
  return new Map(pairs);
}

export function textOf(typed: Typed): string {
  return [...typed].map(([name, text]) => `${name}:${text.replaceAll(";", "")}`).join(";");
}

export const isHex = (parameter: FaultParameter): boolean => HEXADECIMAL.has(parameter.name);

/** A number as it is typed and shown; the manuals' hexadecimal where the number is known so. */
export function numberText(parameter: FaultParameter, number: number, language: Language): string {
  const digits = parameter.high.toString(16).length;
  if (isHex(parameter)) return `${number.toString(16).toUpperCase().padStart(digits, "0")}h`;
  return localise(String(number), language);
}

/** Reads `1.5`, `1,5`, `0x60FB` and `60FBh`; null for anything else. */
export function numberOf(text: string): number | null {
  const hex = HEX.exec(text.trim());
  if (hex) return parseInt(hex[1] ?? hex[2] ?? "", 16);
  return DECIMAL.test(text.trim()) ? Number(text.trim().replace(",", ".")) : null;
}

export type Flaw = "no_number" | "not_whole" | "range";

/** What is wrong with a typed text, if anything. */
export function flawOf(parameter: FaultParameter, text: string): Flaw | null {
  if (text.trim() === "" && parameter.name === FOR) return null;
  const number = numberOf(text);
  if (number === null) return "no_number";
  if (parameter.integer && !Number.isInteger(number)) return "not_whole";
  return number < parameter.low || number > parameter.high ? "range" : null;
}

/** `0 … 130 %` */
export function limitsOf(parameter: FaultParameter, language: Language): string {
  const [low, high] = [parameter.low, parameter.high].map((one) => numberText(parameter, one, language));
  return `${low ?? ""} … ${high ?? ""} ${parameter.unit}`.trim();
}

/** The fields of a kind: its values, and the duration where one can be given. */
export function fieldsOf(kind: FaultKind): FaultParameter[] {
  return kind.momentary ? kind.parameters : [...kind.parameters, DURATION];
}

/** Where a fault goes. */
export interface Place {
  blade: number | null;
  node: number | null;
}

/** What stands in a field: what was typed, else the default; a duration has none. */
export function shownIn(field: FaultParameter, typed: Typed, language: Language): string {
  const usual = field.name === FOR ? "" : numberText(field, field.default, language);
  return typed.get(field.name) ?? usual;
}

/** The order, or null while a text is wrong. */
export function orderOf(kind: FaultKind, place: Place, typed: Typed): FaultOrder | null {
  const wrong = fieldsOf(kind).filter((field) => {
    const text = typed.get(field.name);
    return text !== undefined && flawOf(field, text) !== null;
  });
  if (wrong.length > 0) return null;
  const values: Record<string, number> = {};
  for (const { name } of kind.parameters) {
    const number = numberOf(typed.get(name) ?? "");
    if (number !== null) values[name] = number;
  }
  const seconds = kind.momentary ? null : numberOf(typed.get(FOR) ?? "");
  return { kind: kind.id, ...place, values, seconds };
}
