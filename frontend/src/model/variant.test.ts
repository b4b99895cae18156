import { describe, expect, it } from "vitest";
import type { DescriptionDoc, EntryDoc } from "../api/types";
import { asVariant, variantOf } from "./variant";

const entry = {
  address: "2031",
  default: null,
  minimum: null,
  maximum: 9000,
  by_variant: { b: { default: 6000, minimum: null, maximum: null } },
} as unknown as EntryDoc;
const doc = {
  name: "Any of them",
  variant_matches: [
    { id: "a", name: "Drive A", device_name: "DRIVE-A", product_code: 0x36 },
    { id: "b", name: "Drive B", device_name: "DRIVE-B", product_code: 0x48 },
  ],
  entries: [entry],
} as unknown as DescriptionDoc;
const saying = (said: Record<string, string | number>) => (address: string) => said[address] ?? null;

describe("variants", () => {
  it("go by what the device says of itself, and by nothing where that is not clear", () => {
    expect(variantOf(doc, saying({ "1008": "TWIN DRIVE-B-65", "1018:02": 0x48 }))).toBe("b");
    expect(variantOf(doc, saying({ "1018:02": 0x36 }))).toBe("a");
    expect(variantOf(doc, saying({ "1008": "DRIVE-A", "1018:02": 0x48 }))).toBeNull();
    expect(variantOf(doc, saying({}))).toBeNull();
    expect(variantOf({ ...doc, variant_matches: [] }, saying({ "1008": "x" }))).toBeNull();
  });

  it("have their own defaults, and the limits of all where they have none of their own", () => {
    const own = asVariant(doc, "b");
    expect(own.name).toBe("Drive B");
    expect(own.entries[0]).toMatchObject({ default: 6000, maximum: 9000 });
    expect(asVariant(doc, "b")).toBe(own);
    expect(asVariant(doc, "a").entries[0]).toBe(entry);
    expect(asVariant(doc, null)).toBe(doc);
  });
});
