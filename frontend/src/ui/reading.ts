/** One object of a device as a reading: its value in words, how fresh it is, and where it stands in the parameters. */
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { useDescriptionQuery } from "../api/queries";
import type { DescriptionDoc, DeviceRef, EntryDoc, Language, Raw } from "../api/types";
import { alike } from "../live/alike";
import { useDerived, useHearing, useStore } from "../live/live";
import type { Cell, LiveStore } from "../live/store";
import { type DeviceContext, type Shown, shownOf } from "../model/shown";
import { figure } from "../model/values";
import { asVariant, variantOf } from "../model/variant";
import { useTexts } from "../texts/texts";
import { age } from "./format";

const REFRESH_MS = 1000;

/** How old a value may be before it is shown as old, by how often the bench reads it. */
export const FRESH_MS = { fast: 1500, slow: 4000, rare: 35_000, kept: Infinity } as const;
export type Pace = keyof typeof FRESH_MS;

export interface Reading {
  entry: EntryDoc;
  raw: Raw;
  /** Value and unit, or the names of bits that are set. */
  text: string;
  unit: string;
  names: string[];
  stale: boolean;
  /** As of when anything that is shown of it changed; while it is stale its age is shown. */
  ageMs: number;
}

const indexes = new WeakMap<DescriptionDoc, ReadonlyMap<string, EntryDoc>>();

/** The entries of a description by address. */
export function entriesOf(doc: DescriptionDoc): ReadonlyMap<string, EntryDoc> {
  let found = indexes.get(doc);
  if (!found) {
    found = new Map(doc.entries.map((entry) => [entry.address, entry]));
    indexes.set(doc, found);
  }
  return found;
}

/** Latest raw value of an object, null where it is not known. */
export function rawAt(store: LiveStore, device: string, address: string): Raw | null {
  const cell = store.cell(device, address);
  return cell?.known ? cell.raw : null;
}

/** What is needed to read the values of a device; null until its description is there. */
export function useDeviceContext(device: DeviceRef | undefined): DeviceContext | null {
  const t = useTexts();
  const store = useStore();
  const describe = useDescriptionQuery();
  const doc = useQuery({
    ...describe(device?.description_id ?? ""),
    enabled: device !== undefined,
  }).data;
  return useMemo(() => {
    if (!device || !doc) return null;
    const { slug, node } = device;
    const lookup = (address: string) => rawAt(store, slug, address);
    return {
      slug,
      node,
      get doc() {
        return asVariant(doc, variantOf(doc, lookup));
      },
      t,
      lookup,
    };
  }, [device, doc, store, t]);
}

const MILLI = 1000;

/** A voltage in V where the device counts mV: 565.0 V is read faster than 564965 mV. The parameters show it as it is. */
function atAGlance(shown: Shown, raw: Raw, language: Language): Shown {
  if (shown.unit !== "mV" || typeof raw !== "number") return shown;
  return { ...shown, text: figure(raw / MILLI, 1, language), unit: "V" };
}

export function readingOf(
  context: DeviceContext,
  address: string,
  cell: Cell | undefined,
  pace: Pace,
  nowMs: number,
  silent: boolean,
): Reading | null {
  const entry = entriesOf(context.doc).get(address);
  if (!entry || !cell?.known || cell.raw === null) return null;
  const { text, unit, names } = atAGlance(shownOf(entry, cell.raw, context), cell.raw, context.t.language);
  const ageMs = cell.t_ns === null ? Infinity : Math.max(0, nowMs - cell.t_ns / 1e6);
  const stale = cell.stale || silent || ageMs > FRESH_MS[pace];
  return { entry, raw: cell.raw, text, unit, names, stale, ageMs };
}

/** Topics by which it is known whether a device is heard; besides whether the page hears the bench. */
const HEARD = ["nodes", "link"];

/** The present reading of an object, renewed where other words or marks are shown for it. */
export function useReading(context: DeviceContext | null, address: string, pace: Pace): Reading | null {
  const deaf = useHearing().state !== "hearing";
  return useDerived(
    readingTopics(context, address),
    (store) => context && readingIn(store, context, address, pace, deaf),
    { everyMs: REFRESH_MS, same: (one, other) => sameReading(one, other, context?.t.language ?? "en") },
  );
}

/** What the reading of an object depends on. */
export function readingTopics(context: DeviceContext | null, ...addresses: string[]): string[] {
  return context === null
    ? []
    : [...HEARD, ...addresses.map((address) => `value:${context.slug}/${address}`)];
}

/** The reading of an object as it is now. */
export function readingIn(
  store: LiveStore,
  context: DeviceContext,
  address: string,
  pace: Pace,
  deaf: boolean,
): Reading | null {
  const silent = deaf || unheardIn(store, context.slug);
  return readingOf(context, address, store.cell(context.slug, address), pace, store.serverNowMs(), silent);
}

/** Nobody sees a difference between them: the age counts only in words, and where it is shown. */
export function sameReading(one: Reading | null, other: Reading | null, language: Language): boolean {
  if (one === null || other === null) return one === other;
  const { ageMs, ...rest } = one;
  const { ageMs: otherMs, ...otherRest } = other;
  return alike(rest, otherRest) && (!one.stale || age(ageMs, language) === age(otherMs, language));
}

function unheardIn(store: LiveStore, slug: string): boolean {
  return store.link?.state !== "connected" || (store.nodes.get(slug)?.silent ?? false);
}

/** True while nothing can come from the device: the page is deaf, the bus is gone, or its heartbeat is overdue. */
export function useUnheard(slug: string): boolean {
  const deaf = useHearing().state !== "hearing";
  return useDerived(HEARD, (store) => deaf || unheardIn(store, slug));
}
