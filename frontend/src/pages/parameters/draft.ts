/** What is being typed for one object, read and checked with every key. */
import { useState } from "react";
import type { EntryDoc, Raw } from "../../api/types";
import { type DeviceContext, limitText } from "../../model/shown";
import { isFloat, isHex, isInteger, Misfit, parse, type Parsed, quantityOf, show } from "../../model/values";
import { plannedContext } from "./staging";

export interface Draft {
  text: string;
  setText: (text: string) => void;
  parsed: Parsed;
  /** What would be written; null while the text is refused. */
  raw: Raw | null;
  /** Why it is refused, limit and unit named; null while it fits or nothing was typed. */
  error: string | null;
  /** Limits and step in words, for whoever types. */
  hint: string;
  /** One step of the resolution up or down, within the limits. */
  step: (direction: 1 | -1) => void;
}

/** Checks against what other objects will hold once what is pending is written. */
export function useDraft(entry: EntryDoc, device: DeviceContext, start: string): Draft {
  const [text, setText] = useState(start);
  return {
    ...draftOf(entry, device, text),
    setText,
    step: (direction) => setText(stepped(entry, device, text, direction)),
  };
}

export function draftOf(entry: EntryDoc, device: DeviceContext, text: string) {
  const context = plannedContext(device);
  const parsed = parse(device.doc, entry, text, context.lookup);
  return {
    text,
    parsed,
    raw: parsed.ok ? parsed.raw : null,
    error: refusal(parsed, text, entry, context),
    hint: hintOf(entry, context),
  };
}

function refusal(parsed: Parsed, text: string, entry: EntryDoc, context: DeviceContext): string | null {
  if (parsed.ok || (parsed.why === Misfit.Empty && text === "")) return null;
  return context.t(`page.misfit.${parsed.why}`, {
    limits: limitText(entry, context, true),
    unit: isHex(entry) ? "" : quantityOf(entry, context.lookup).unit,
    step: stepText(entry, context),
  });
}

function stepText(entry: EntryDoc, context: DeviceContext): string {
  if (!isInteger(entry)) return "";
  return show({ ...entry, hexadecimal: false, bits: null }, entry.step, context.lookup, context.t.language);
}

function hintOf(entry: EntryDoc, context: DeviceContext): string {
  const limits = limitText(entry, context, true);
  if (limits === "") return "";
  const unit = isHex(entry) ? "" : quantityOf(entry, context.lookup).unit;
  return context.t("page.entry.allowed", { limits, unit }).trim();
}

/** The next value of the resolution; unchanged where the text is no number or would leave the limits. */
function stepped(entry: EntryDoc, device: DeviceContext, text: string, direction: 1 | -1): string {
  const context = plannedContext(device);
  const parsed = parse(device.doc, entry, text, context.lookup);
  if (!parsed.ok || typeof parsed.raw !== "number" || !isInteger(entry)) return text;
  const next = show(entry, nextOf(entry, parsed.raw, direction), context.lookup, context.t.language);
  return parse(device.doc, entry, next, context.lookup).ok ? next : text;
}

/** The raw value after this one: the next of those that there are, or one step on. */
function nextOf(entry: EntryDoc, raw: number, direction: 1 | -1): number {
  if (entry.only.length === 0) return raw + direction * entry.step;
  const sorted = entry.only.toSorted((a, b) => a - b);
  return sorted[sorted.indexOf(raw) + direction] ?? raw;
}

/** A plain number may be edited in the table; bits, names, texts and octets need the panel. */
export const isInline = (entry: EntryDoc): boolean =>
  (isInteger(entry) || isFloat(entry)) && entry.enumeration === null && entry.bits === null;

export const startText = (entry: EntryDoc, raw: Raw | null, { lookup, t }: DeviceContext): string =>
  raw === null ? "" : show(entry, raw, lookup, t.language);
