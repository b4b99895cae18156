/** What can stand in a column: the states of each connected device, and the sets of the library. */
import { ofDevice, Source } from "./specs";

export interface Choice {
  column: string;
  label: string;
  hint: string;
  group: string;
  /** Lower case text that the search of the picker looks through. */
  haystack: string;
}

export interface DeviceChoice {
  slug: string;
  name: string;
  descriptionId: string;
  connected: boolean;
}

const OF_CONNECTED = [Source.Live, Source.Stored, Source.Editor, Source.Default] as const;
const OF_KEPT = [Source.Found, Source.Left, Source.Delivered, Source.Golden, Source.Year] as const;

export interface Words {
  source: (source: Source) => string;
  hint: (source: Source) => string;
}

/** The columns that devices give: those of the reference's device first, as they are wanted most. */
export function deviceChoices(
  devices: readonly DeviceChoice[],
  first: string | null,
  words: Words,
): Choice[] {
  const ordered = devices.toSorted((a, b) => Number(b.slug === first) - Number(a.slug === first));
  return ordered.flatMap((device) =>
    [...(device.connected ? OF_CONNECTED : []), ...OF_KEPT].map((source) =>
      choice(ofDevice(source, device.slug), words.source(source), words.hint(source), device.name),
    ),
  );
}

export function choice(column: string, label: string, hint: string, group: string): Choice {
  return { column, label, hint, group, haystack: `${group} ${label} ${hint}`.toLowerCase() };
}

/** Those that have every word of the search. */
export function foundChoices(choices: readonly Choice[], search: string): Choice[] {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  return choices.filter((one) => words.every((word) => one.haystack.includes(word)));
}

/** As groups in the order in which they come. */
export function grouped(choices: readonly Choice[]): [string, Choice[]][] {
  const groups = new Map<string, Choice[]>();
  for (const one of choices) groups.set(one.group, [...(groups.get(one.group) ?? []), one]);
  return [...groups];
}
