/** The filters beside the text: what differs, what is pending, what a person has starred. */
import type { LiveStore } from "../../live/store";
import type { GroupTally, ParameterRow } from "../../model/rows";
import type { StagedState } from "../../model/staged";
import { keyOf } from "../../model/staged";
import { differsFromDefault, isUnsaved, rawOf } from "./cellValue";
import type { Bench } from "./context";

export enum Only {
  /** From the default, in any of the devices shown. */
  Changed = "changed",
  /** Between the devices of the kind. */
  Different = "different",
  /** RAM is not what is stored, in any of the devices shown: a save would keep it, a restart would lose it. */
  Unsaved = "unsaved",
  Starred = "starred",
  Pending = "pending",
}

export const readOnly = (text: string | undefined): ReadonlySet<Only> => {
  const names = (text ?? "").split(",");
  return new Set(Object.values(Only).filter((one) => names.includes(one)));
};

export const writeOnly = (only: ReadonlySet<Only>): string | undefined =>
  only.size === 0 ? undefined : [...only].join();

/** True where two devices are known to hold different values; what is unknown differs from nothing. */
export function differsBetween(address: string, slugs: readonly string[], store: LiveStore): boolean {
  let first: string | number | null = null;
  for (const slug of slugs) {
    const raw = rawOf(store.cell(slug, address));
    if (raw === null) continue;
    if (first !== null && raw !== first) return true;
    first = raw;
  }
  return false;
}

/** Every filter that is set must let the row pass. */
export function filterOnly(
  rows: readonly ParameterRow[],
  only: ReadonlySet<Only>,
  bench: Bench,
  staged: StagedState,
): readonly ParameterRow[] {
  if (only.size === 0) return rows;
  const slugs = bench.siblings.map((one) => one.slug);
  const tests: Record<Only, (row: ParameterRow) => boolean> = {
    [Only.Changed]: ({ entry }) =>
      bench.devices.some(({ slug, node }) =>
        differsFromDefault(entry, bench.store.cell(slug, entry.address), node),
      ),
    [Only.Different]: ({ entry }) => isCompared(entry) && differsBetween(entry.address, slugs, bench.store),
    [Only.Unsaved]: ({ entry }) =>
      bench.devices.some(({ slug }) => isUnsaved(entry, bench.store.cell(slug, entry.address))),
    [Only.Starred]: ({ entry }) => bench.starred.has(entry.address),
    [Only.Pending]: ({ entry }) =>
      bench.devices.some(({ slug }) => staged.changes.has(keyOf(slug, entry.address))),
  };
  const wanted = [...only].map((one) => tests[one]);
  return rows.filter((row) => wanted.every((test) => test(row)));
}

/** Only what is set by somebody is compared: a measured value differs at any time and says nothing. */
export const isCompared = (entry: ParameterRow["entry"]): boolean => entry.writable && !entry.motion;

export function tallyOf(rows: readonly ParameterRow[], bench: Bench, staged: StagedState): GroupTally {
  const slugs = bench.siblings.map((one) => one.slug);
  const tally = new Map<string, { pending: number; different: number }>();
  for (const { entry, group } of rows) {
    const sum = tally.get(group) ?? { pending: 0, different: 0 };
    tally.set(group, sum);
    if (slugs.some((slug) => staged.changes.has(keyOf(slug, entry.address)))) sum.pending += 1;
    if (isCompared(entry) && differsBetween(entry.address, slugs, bench.store)) sum.different += 1;
  }
  return tally;
}
