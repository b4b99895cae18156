/**
 * The three forms of a value: raw (as the object holds it), scaled (number with a unit), shown (text).
 * The same readings as the server's, so that what is typed here is refused here; the server decides all the same.
 */
import type { DescriptionDoc, EntryDoc, Language, LimitDoc, QuantityDoc, Raw, RuleDoc } from "../api/types";
import { divide, type Fraction, fraction, fractionOf, times, toFixed, toNumber, wholeOf } from "./decimal";

/** Latest known raw value of another object of the device. */
export type Lookup = (address: string) => Raw | null;

export interface Quantity {
  unit: string;
  scale: Fraction;
  decimals: number;
}

const MAX_DECIMALS = 6;
const FULL_TURN_DEG = 360;
const TEXT_TYPES = new Set(["VISIBLE_STRING", "UNICODE_STRING"]);
const FLOAT_TYPES = new Set(["REAL32", "REAL64"]);

export const isText = (entry: EntryDoc): boolean => TEXT_TYPES.has(entry.type);
export const isFloat = (entry: EntryDoc): boolean => FLOAT_TYPES.has(entry.type);
export const isInteger = (entry: EntryDoc): boolean => entry.range !== null;
export const isOctets = (entry: EntryDoc): boolean => !isText(entry) && !isFloat(entry) && !isInteger(entry);

/** Unit and factor in force; those of the defaults where they rest on objects that are not known. */
export function quantityOf(entry: EntryDoc, lookup: Lookup): Quantity {
  const own = quantity(entry);
  const rule = entry.unit_from;
  if (!rule) return own;
  const source = lookup(rule.address);
  if (typeof source !== "number") return own;
  if (rule.shaft === null) {
    const choice = rule.choices[String(source)];
    return choice ? quantity(choice) : own;
  }
  const shaft = lookup(rule.shaft);
  if (typeof shaft !== "number" || shaft === 0 || source === 0) return own;
  // A feed of `source` units per `shaft` revolutions (CiA 402), shown in degrees.
  return { ...own, scale: divide(fractionOf(FULL_TURN_DEG * shaft), fractionOf(source)) };
}

function quantity(doc: QuantityDoc): Quantity {
  return { unit: doc.unit, scale: fractionOf(doc.scale), decimals: Math.min(doc.decimals, MAX_DECIMALS) };
}

export const isHex = (entry: EntryDoc): boolean => entry.hexadecimal || entry.bits !== null;

/** Text of a value without its unit, in the manner of the language (decimal comma in German). */
export function show(entry: EntryDoc, raw: Raw, lookup: Lookup, language: Language): string {
  if (isOctets(entry)) return octets(String(raw));
  const exact = fraction(String(raw));
  if (isText(entry) || exact === null) return String(raw);
  if (entry.ipv4) return dotted(Number(raw));
  if (isHex(entry) && isInteger(entry)) return hexadecimal(entry, raw);
  const { scale, decimals } = quantityOf(entry, lookup);
  const scaled = times(exact, scale);
  const text = isFloat(entry) ? shortest(toNumber(scaled)) : toFixed(scaled, decimals);
  return localise(text, language);
}

export function localise(text: string, language: Language): string {
  return language === "de" ? text.replace(".", ",") : text;
}

/** Plain number with a fixed count of decimals, for figures that are no parameters. */
export function figure(number: number, decimals: number, language: Language): string {
  return localise(number.toFixed(decimals), language);
}

/** A bit rate in kbit/s; a dash where the bus has none of its own, as Ethernet. */
export const rateText = (bitrate: number, language: Language): string =>
  bitrate > 0 ? figure(bitrate / 1000, 0, language) : "–";

/** The four numbers of an address of the internet, the highest byte first. */
function dotted(number: number): string {
  return [24, 16, 8, 0].map((bits) => (number >>> bits) & 0xff).join(".");
}

export function hexadecimal(entry: EntryDoc, raw: Raw): string {
  const bits = BigInt(Math.max(8, entry.bit_count ?? 8));
  const pattern = BigInt.asUintN(Number(bits), BigInt(raw));
  return `${pattern
    .toString(16)
    .toUpperCase()
    .padStart(Number(bits / 4n), "0")}h`;
}

function octets(hex: string): string {
  return (
    hex
      .replaceAll(" ", "")
      .toUpperCase()
      .match(/.{1,2}/g) ?? []
  ).join(" ");
}

function shortest(number: number): string {
  return String(Number(number.toPrecision(7)));
}

/** Raw default, with the node's number added where the description says so; null where none is given. */
export function defaultOf(entry: EntryDoc, node: number): Raw | null {
  if (entry.default === null) return null;
  if (typeof entry.default === "object") return entry.default.hex.toLowerCase();
  return entry.node_id && typeof entry.default === "number" ? entry.default + node : entry.default;
}

export interface Limits {
  low: number | null;
  high: number | null;
}

/** Names, bits and limits as other objects have them now; where those are not known, what holds in all cases. */
export function inForce(entry: EntryDoc, lookup: Lookup): EntryDoc {
  const { enumeration_from: names, bits_from: bits, limits_from: limits } = entry;
  if (names === null && bits === null && limits === null) return entry;
  return {
    ...entry,
    enumeration: chosen(names, lookup) ?? entry.enumeration,
    bits: chosen(bits, lookup) ?? entry.bits,
    ...chosen(limits, lookup),
  };
}

function chosen<T>(rule: RuleDoc<T> | null, lookup: Lookup): T | undefined {
  const found = rule === null ? null : lookup(rule.address);
  return typeof found === "number" ? rule?.choices[String(found)] : undefined;
}

/** Raw limits in force, those of the data type included; a limit that rests on an unknown object is left out. */
export function limitsOf(described: EntryDoc, lookup: Lookup): Limits {
  const entry = inForce(described, lookup);
  const [typeLow, typeHigh] = entry.range ?? [null, null];
  return {
    low: tighter(resolve(entry.minimum, lookup), typeLow, Math.max),
    high: tighter(resolve(entry.maximum, lookup), typeHigh, Math.min),
  };
}

/** Limits that the description itself sets, for the table: those of the data type alone tell nobody anything. */
export function ownLimitsOf(described: EntryDoc, lookup: Lookup): Limits {
  const entry = inForce(described, lookup);
  return { low: resolve(entry.minimum, lookup), high: resolve(entry.maximum, lookup) };
}

function resolve(limit: LimitDoc | null, lookup: Lookup): number | null {
  if (limit === null || typeof limit === "number") return limit;
  const found = lookup(limit.address);
  return typeof found === "number" ? toNumber(times(fractionOf(found), fractionOf(limit.factor))) : null;
}

function tighter(
  own: number | null,
  type: number | null,
  pick: (a: number, b: number) => number,
): number | null {
  if (own === null || type === null) return own ?? type;
  return pick(own, type);
}

export enum Misfit {
  Empty = "empty",
  NoNumber = "no_number",
  NoHex = "no_hex",
  Unit = "unit",
  Resolution = "resolution",
  BelowLimit = "below",
  AboveLimit = "above",
  NotListed = "not_listed",
  NotAscii = "not_ascii",
  NoAddress = "no_address",
}

export type Parsed = { ok: true; raw: Raw } | { ok: false; why: Misfit };

const NUMBER = /^([-+]?\d+(?:[.,]\d+)?)\s*(\D.*)?$/;
const HEX = /^(?:0x([0-9a-f]+)|([0-9a-f]+)h)$/i;
const RAW = /^raw:\s*([-+]?\d+|0x[0-9a-f]+)$/i;

/** Reads what a person typed: `49.5`, `49,5 °C`, `0x1F`, `1Fh`, `raw:495`, `192.168.2.20`; checks type, resolution and limits. */
export function parse(doc: DescriptionDoc, entry: EntryDoc, typed: string, lookup: Lookup): Parsed {
  const text = typed.trim();
  // eslint-disable-next-line no-control-regex -- a VISIBLE_STRING is ASCII
  if (isText(entry)) return /^[\x00-\x7f]*$/.test(text) ? { ok: true, raw: text } : misfit(Misfit.NotAscii);
  if (text === "") return misfit(Misfit.Empty);
  if (isOctets(entry)) return parseOctets(text);
  const parsed = ipv4(entry, text) ?? rawNumber(entry, text) ?? scaledNumber(entry, text, lookup);
  return parsed.ok ? checkNumber(doc, entry, parsed.raw, lookup) : parsed;
}

/** Checks a raw number against limits and an exclusive enumeration. */
function checkNumber(doc: DescriptionDoc, entry: EntryDoc, raw: Raw, lookup: Lookup): Parsed {
  const why = misfitOf(doc, entry, raw, lookup);
  return why === null ? { ok: true, raw } : misfit(why);
}

/** Why a raw value is refused while other objects have the values that `lookup` knows; null where it fits. */
export function misfitOf(doc: DescriptionDoc, entry: EntryDoc, raw: Raw, lookup: Lookup): Misfit | null {
  if (!isInteger(entry) && !isFloat(entry)) return null;
  const { low, high } = entry.also.includes(Number(raw))
    ? { low: null, high: null }
    : limitsOf(entry, lookup);
  if (low !== null && Number(raw) < low) return Misfit.BelowLimit;
  if (high !== null && Number(raw) > high) return Misfit.AboveLimit;
  if (entry.only.length > 0 && !entry.only.includes(Number(raw))) return Misfit.NotListed;
  if (entry.step > 1 && Number(raw) % entry.step !== 0) return Misfit.Resolution;
  const { enumeration } = inForce(entry, lookup);
  const table = enumeration === null ? undefined : doc.enumerations[enumeration];
  if (table?.exclusive && !table.values.some((one) => one.value === raw)) return Misfit.NotListed;
  return null;
}

/** Addresses of the objects that unit, names, limits and preconditions of an entry rest on. */
export function restsOn(entry: EntryDoc): string[] {
  const rules = [entry.limits_from, entry.enumeration_from, entry.bits_from].flatMap(
    (rule) => rule?.address ?? [],
  );
  const limits = [entry.minimum, entry.maximum].flatMap((limit) =>
    limit !== null && typeof limit === "object" ? [limit.address] : [],
  );
  const unit = entry.unit_from === null ? [] : [entry.unit_from.address, entry.unit_from.shaft];
  const found = [...limits, ...rules, ...unit, ...entry.requires.map((one) => one.address)];
  return [...new Set(found.filter((address): address is string => address !== null))];
}

function parseOctets(text: string): Parsed {
  const digits = text.replaceAll(/\s/g, "");
  if (!/^(?:[0-9a-f]{2})+$/i.test(digits)) return misfit(Misfit.NoHex);
  return { ok: true, raw: digits.toLowerCase() };
}

/** Four numbers with points between; whatever has a point is meant so. */
function ipv4(entry: EntryDoc, text: string): Parsed | null {
  if (!entry.ipv4 || !text.includes(".")) return null;
  const numbers = text.split(".");
  const fits =
    numbers.length === 4 && numbers.every((one) => /^(?:0|[1-9]\d{0,2})$/.test(one) && Number(one) < 256);
  if (!fits) return misfit(Misfit.NoAddress);
  return { ok: true, raw: numbers.reduce((whole, one) => whole * 256 + Number(one), 0) };
}

function rawNumber(entry: EntryDoc, text: string): Parsed | null {
  const marked = RAW.exec(text);
  if (marked)
    return safe(
      marked[1]?.startsWith("-") ? -BigInt(marked[1].slice(1)) : BigInt((marked[1] ?? "0").replace("+", "")),
    );
  const hex = HEX.exec(text);
  if (!hex) return null;
  const number = BigInt(`0x${hex[1] ?? hex[2] ?? "0"}`);
  const bits = entry.bit_count ?? 0;
  // A hexadecimal number is a bit pattern: FFFFh of an INTEGER16 is -1.
  const signed = (entry.range?.[0] ?? 0) < 0 && bits > 0 && number >> BigInt(bits - 1) === 1n;
  return safe(signed ? number - (1n << BigInt(bits)) : number);
}

function scaledNumber(entry: EntryDoc, text: string, lookup: Lookup): Parsed {
  const match = NUMBER.exec(text);
  const typed = match ? fraction(match[1] ?? "") : null;
  if (!match || !typed) return misfit(Misfit.NoNumber);
  const { unit, scale } = quantityOf(entry, lookup);
  const typedUnit = match[2]?.trim() ?? "";
  if (typedUnit !== "" && typedUnit !== unit) return misfit(Misfit.Unit);
  const exact = divide(typed, scale);
  if (isFloat(entry)) return { ok: true, raw: toNumber(exact) };
  const whole = wholeOf(exact);
  return whole === null ? misfit(Misfit.Resolution) : safe(whole);
}

/** Integers beyond 2^53 travel as decimal digits. */
function safe(number: bigint): Parsed {
  const plain = Number(number);
  return { ok: true, raw: Number.isSafeInteger(plain) ? plain : number.toString() };
}

function misfit(why: Misfit): Parsed {
  return { ok: false, why };
}
