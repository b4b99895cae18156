/** How a value is put before a person: names of enumerations and bits, numbers with units, the raw value beside it. */
import type { DescriptionDoc, EntryDoc, Raw } from "../api/types";
import type { Translate } from "../texts/texts";
import { setBits } from "./bits";
import { inForce, type Limits, type Lookup, limitsOf, ownLimitsOf, quantityOf, show } from "./values";

export interface Shown {
  text: string;
  unit: string;
  /** Names of bits that are set, in words. */
  names: string[];
}

/** What is needed to read the values of one device. */
export interface DeviceContext {
  slug: string;
  node: number;
  doc: DescriptionDoc;
  lookup: Lookup;
  t: Translate;
}

export function shownOf(described: EntryDoc, raw: Raw, { doc, lookup, t }: DeviceContext): Shown {
  const entry = inForce(described, lookup);
  const text = show(entry, raw, lookup, t.language);
  if (typeof raw === "string") return { text, unit: "", names: [] };
  const named = entry.enumeration === null ? undefined : enumName(doc, entry.enumeration, raw);
  if (named !== undefined) return { text: t(named), unit: "", names: [] };
  const table = entry.bits === null ? [] : (doc.bit_tables[entry.bits] ?? []);
  const names = setBits(entry, raw, table).map((bit) => bit.clamp ?? t(bit.text_key));
  return { text, unit: entry.hexadecimal ? "" : quantityOf(entry, lookup).unit, names };
}

function enumName(doc: DescriptionDoc, id: string, raw: number): string | undefined {
  return doc.enumerations[id]?.values.find((one) => one.value === raw)?.text_key;
}

/** Value with its unit, or names of its bits, in one line. */
export function lineOf(shown: Shown): string {
  const plain = shown.unit === "" ? shown.text : `${shown.text} ${shown.unit}`;
  return shown.names.length === 0 ? plain : `${plain} · ${shown.names.join(", ")}`;
}

/** `10.0 … 70.0` in scaled form; a dash for a side that is open or not known. Empty where there are none at all. */
export function limitText(entry: EntryDoc, context: DeviceContext, all: boolean): string {
  const limits: Limits = all ? limitsOf(entry, context.lookup) : ownLimitsOf(entry, context.lookup);
  if (limits.low === null && limits.high === null) return "";
  const side = (raw: number | null) =>
    raw === null ? "–" : show(entry, raw, context.lookup, context.t.language);
  if (entry.only.length > 0) return entry.only.map(side).join(", ");
  const also = entry.also.map((raw) => `, ${side(raw)}`).join("");
  return `${side(limits.low)} … ${side(limits.high)}${also}`;
}
