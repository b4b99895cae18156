/** What can stand in a column: the states of each connected device, and the sets of the library. */
import type { SetRecord } from "../../../api/types";
import { ofDevice, Source } from "./specs";

export interface Choice {
  column: string;
  label: string;
  hint: string;
  group: string;
  /** Lower case text that the search of the picker looks through. */
  haystack: string;
  /** There is no such set yet. */
  absent: boolean;
}

export interface DeviceChoice {
  slug: string;
  name: string;
  descriptionId: string;
}

/** What of a device is kept in the library: "found wtg-07/blade-1/pmc", "golden oat-pmc". */
export type Kept = ReadonlySet<string>;

const OF_CONNECTED = [Source.Live, Source.Stored, Source.Editor, Source.Default] as const;
const OF_KEPT = [
  Source.Found,
  Source.Left,
  Source.Delivered,
  Source.Golden,
  Source.Latest,
  Source.Year,
] as const;
const TAGGED = {
  "as-found": Source.Found,
  "as-left": Source.Left,
  "as-delivered": Source.Delivered,
  golden: Source.Golden,
} as const;

const DAY_MS = 86_400_000;
/** A set counts as one of last year from this age on. */
const YEAR_LEAST_MS = 180 * DAY_MS;

export function keptOf(records: readonly SetRecord[], nowMs: number): Kept {
  const kept = new Set<string>();
  for (const { tags, origin, description_id, t_ns } of records) {
    for (const { tag } of tags)
      kept.add(`${TAGGED[tag]} ${tag === "golden" ? description_id : origin.device}`);
    kept.add(`${Source.Latest} ${origin.device}`);
    if (nowMs - t_ns / 1e6 >= YEAR_LEAST_MS) kept.add(`${Source.Year} ${origin.device}`);
  }
  return kept;
}

export interface Words {
  source: (source: Source) => string;
  hint: (source: Source) => string;
  none: string;
}

/**
 * The columns that devices give: those of the reference's device first, as they are wanted most. `kept` null: it is not
 * known which there are.
 */
export function deviceChoices(
  devices: readonly DeviceChoice[],
  first: string | null,
  kept: Kept | null,
  words: Words,
): Choice[] {
  const ordered = devices.toSorted((a, b) => Number(b.slug === first) - Number(a.slug === first));
  return ordered.flatMap(({ slug, name, descriptionId }) => [
    ...OF_CONNECTED.map((source) =>
      choice(ofDevice(source, slug), words.source(source), words.hint(source), name),
    ),
    ...OF_KEPT.map((source) => {
      const scope = source === Source.Golden ? descriptionId : slug;
      const absent = kept !== null && !kept.has(`${source} ${scope}`);
      const hint = absent ? words.none : words.hint(source);
      return { ...choice(ofDevice(source, slug), words.source(source), hint, name), absent };
    }),
  ]);
}

export function choice(column: string, label: string, hint: string, group: string): Choice {
  const haystack = `${group} ${label} ${hint}`.toLowerCase();
  return { column, label, hint, group, haystack, absent: false };
}

/** Those that have every word of the search. */
export function foundChoices(choices: readonly Choice[], search: string): Choice[] {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  return choices.filter((one) => words.every((word) => one.haystack.includes(word)));
}

/** As groups in the order in which they come. */
export function grouped(choices: readonly Choice[]): [string, Choice[]][] {
  const groups = new Map<string, Choice[]>();
  for (const one of choices) {
    const members = groups.get(one.group);
    if (members) members.push(one);
    else groups.set(one.group, [one]);
  }
  return [...groups];
}
