/** What a device saves by: all of it at once, or categories. As the server has it (app/model/saving.py). */
import type { DescriptionDoc } from "../api/types";
import type { Translate } from "../texts/texts";

type Saves = Pick<DescriptionDoc, "save" | "entries">;

/** The categories that can be saved and that hold a parameter, in the order of their commands; none for most devices. */
export function categoriesOf({ save, entries }: Saves): string[] {
  const used = new Set(entries.filter((one) => one.saved).map((one) => one.save_category));
  return save.flatMap(({ category }) => (category !== null && used.has(category) ? [category] : []));
}

/** The saves that keep the values of `addresses`; null saves all. */
export function savesFor(doc: Saves, addresses: readonly string[]): (string | null)[] {
  const wanted = new Set(addresses);
  const kept = doc.entries.filter((one) => one.saved && wanted.has(one.address));
  const parts = new Set(kept.flatMap((one) => one.save_category ?? []));
  const known = doc.save.map((one) => one.category);
  if (kept.length === 0) return [];
  if (parts.size === 0 || [...parts].some((one) => !known.includes(one))) return [null];
  return known.filter((one) => one !== null && parts.has(one));
}

export const categoryName = (category: string | null, t: Translate): string =>
  t(`category.${category ?? "all"}`);
