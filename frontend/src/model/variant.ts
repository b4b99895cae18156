/** Several devices that share one description: which of them one is, and the description with its own defaults and limits. */
import type { DescriptionDoc, EntryDoc } from "../api/types";
import type { Lookup } from "./values";

const DEVICE_NAME = "1008";
const PRODUCT_CODE = "1018:02";
/** What a device says of itself, by which its variant is found. */
export const SAID = [DEVICE_NAME, PRODUCT_CODE] as const;

/** The only variant that the device can be by what it says; null where that is not clear, or there are none. */
export function variantOf(doc: DescriptionDoc, lookup: Lookup): string | null {
  const [name, code] = [lookup(DEVICE_NAME), lookup(PRODUCT_CODE)];
  const fits = doc.variant_matches.filter(({ device_name, product_code }) => {
    const said = [
      device_name !== null && typeof name === "string" && name !== "" ? name.includes(device_name) : null,
      product_code !== null && typeof code === "number" ? code === product_code : null,
    ].filter((one) => one !== null);
    // What it does not say contradicts nothing, but something has to speak for it.
    return said.length > 0 && said.every(Boolean);
  });
  const [only] = fits;
  return fits.length === 1 && only ? only.id : null;
}

const made = new WeakMap<DescriptionDoc, Map<string, DescriptionDoc>>();

/** The description with what differs in this variant; always the same object for the same variant. */
export function asVariant(doc: DescriptionDoc, variant: string | null): DescriptionDoc {
  if (variant === null) return doc;
  const known = made.get(doc) ?? new Map<string, DescriptionDoc>();
  made.set(doc, known);
  const found = known.get(variant) ?? {
    ...doc,
    name: doc.variant_matches.find((one) => one.id === variant)?.name ?? doc.name,
    entries: doc.entries.map((entry) => ownOf(entry, variant)),
  };
  known.set(variant, found);
  return found;
}

function ownOf(entry: EntryDoc, variant: string): EntryDoc {
  const own = entry.by_variant[variant];
  if (!own) return entry;
  return {
    ...entry,
    default: own.default ?? entry.default,
    minimum: own.minimum ?? entry.minimum,
    maximum: own.maximum ?? entry.maximum,
  };
}
