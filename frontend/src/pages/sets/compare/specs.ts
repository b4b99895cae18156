/** The columns of a comparison as a link names them: `live:wtg-07/blade-1/pmc,set:0195...`. The first is the reference. */
import type { PageSearch } from "../../../frame/search";

/** What a column shows. All but a set of the library are of a device, named by its slug. */
export enum Source {
  Live = "live",
  Stored = "stored",
  Editor = "editor",
  Default = "default",
  Golden = "golden",
  Delivered = "delivered",
  Found = "found",
  Left = "left",
  Year = "year",
  Latest = "latest",
  Set = "set",
  Moment = "moment",
}

export interface Spec {
  source: Source;
  /** Slug of the device, or id of the record. */
  of: string;
}

const SOURCES: ReadonlyMap<string, Source> = new Map(Object.values(Source).map((one) => [one, one]));

export const specText = ({ source, of }: Spec): string => `${source}:${of}`;

/** null where it is no column. */
export function parseSpec(text: string): Spec | null {
  const at = text.indexOf(":");
  const source = SOURCES.get(text.slice(0, at));
  const of = text.slice(at + 1).trim();
  return source !== undefined && of !== "" ? { source, of } : null;
}

/** Each once, in their order; what is no column is left out, so that a damaged link opens all the same. */
export function columnsIn(text: string | undefined): string[] {
  const specs = (text ?? "").split(",").flatMap((one) => {
    const spec = parseSpec(one.trim());
    return spec ? [specText(spec)] : [];
  });
  return [...new Set(specs)];
}

export const columnsText = (columns: readonly string[]): string | undefined =>
  columns.length === 0 ? undefined : columns.join();

/** The device that a column is of; null for a set of the library, which says itself whose it is. */
export function deviceOf(column: string): string | null {
  const spec = parseSpec(column);
  if (spec === null || spec.source === Source.Set) return null;
  return spec.source === Source.Moment ? spec.of.slice(spec.of.indexOf("/") + 1) : spec.of;
}

/** What a recording had shown of a device until a time. */
export const momentOf = (recording: string, tNs: number, slug: string): string =>
  specText({ source: Source.Moment, of: `${recording}@${BigInt(tNs)}/${slug}` });

/** True where the column changes while it is looked at. */
export function isLive(column: string): boolean {
  const source = parseSpec(column)?.source;
  return source === Source.Live || source === Source.Stored || source === Source.Editor;
}

export const ofDevice = (source: Source, slug: string): string => specText({ source, of: slug });

/** What opens a comparison of these columns. */
export const compareSearch = (columns: readonly string[]): PageSearch => ({
  tab: "compare",
  columns: columns.join(),
});

/** The column becomes the reference; the others keep their order. */
export const withReference = (columns: readonly string[], column: string): string[] => [
  column,
  ...columns.filter((one) => one !== column),
];

/** The column goes one place to the left (-1) or to the right (1), as far as there is one. */
export function moved(columns: readonly string[], column: string, by: -1 | 1): string[] {
  const at = columns.indexOf(column);
  const to = at + by;
  const next = [...columns];
  if (at < 0 || to < 0 || to >= columns.length) return next;
  next.splice(at, 1);
  next.splice(to, 0, column);
  return next;
}
