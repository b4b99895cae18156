import { describe, expect, it } from "vitest";
import type { EntryDoc } from "../../api/types";
import type { Cell } from "../../live/store";
import { differsFromDefault, isStale, isStoredUnknown, isUnsaved, rawOf } from "./cellValue";
import { compareRaw } from "./columns";
import { csvOf, tsvOf } from "../../ui/export";

const NOW_MS = 1_700_000_000_000;
const entry = (change: Partial<EntryDoc> = {}) =>
  ({ saved: true, writable: true, pdo: false, default: 500, node_id: false, ...change }) as EntryDoc;
const cell = (change: Partial<Cell> = {}): Cell => ({
  raw: 500,
  hex: "f401",
  t_ns: NOW_MS * 1e6,
  source: "sdo-read",
  stored: null,
  known: true,
  stale: false,
  changedAtMs: null,
  ...change,
});

describe("a value in RAM", () => {
  it("is nothing where it is not known", () => {
    expect(rawOf(undefined)).toBeNull();
    expect(rawOf(cell({ known: false }))).toBeNull();
    expect(rawOf(cell())).toBe(500);
  });

  it("is unsaved where it is not what is stored", () => {
    expect(isUnsaved(entry(), cell({ stored: { raw: 500, state: "saved" } }))).toBe(false);
    expect(isUnsaved(entry(), cell({ stored: { raw: 499, state: "proven" } }))).toBe(true);
    expect(isUnsaved(entry({ saved: false }), cell({ stored: { raw: 499, state: "proven" } }))).toBe(false);
  });

  it("is unsaved where it was written or changed and nothing is known of what is stored", () => {
    expect(isUnsaved(entry(), cell())).toBe(false);
    expect(isUnsaved(entry(), cell({ source: "sdo-write" }))).toBe(true);
    expect(isUnsaved(entry(), cell({ changedAtMs: 1 }))).toBe(true);
    expect(isStoredUnknown(entry(), cell())).toBe(true);
    expect(isStoredUnknown(entry(), cell({ stored: { raw: 1, state: "saved" } }))).toBe(false);
  });

  it("grows stale when nobody is heard, frames were lost, or the device changes it by itself", () => {
    const later = NOW_MS + 10_001;
    expect(isStale(entry(), cell(), later, false)).toBe(false);
    expect(isStale(entry(), cell(), NOW_MS, true)).toBe(true);
    expect(isStale(entry(), cell({ stale: true }), NOW_MS, false)).toBe(true);
    expect(isStale(entry({ pdo: true, saved: false }), cell(), later, false)).toBe(true);
    expect(isStale(entry({ pdo: true, saved: false }), cell(), later - 1, false)).toBe(false);
  });

  it("differs from the default only where both are known", () => {
    expect(differsFromDefault(entry(), cell(), 1)).toBe(false);
    expect(differsFromDefault(entry(), cell({ raw: 485 }), 1)).toBe(true);
    expect(differsFromDefault(entry({ default: null }), cell(), 1)).toBe(false);
    expect(differsFromDefault(entry(), cell({ known: false }), 1)).toBe(false);
  });
});

describe("tables", () => {
  it("sort unknown first, numbers by size, texts by letters", () => {
    expect([10, null, 9, "b", "a"].sort(compareRaw)).toEqual([null, 9, 10, "a", "b"]);
  });

  it("are taken along whole", () => {
    expect(tsvOf([["a", "b\tc\nd"]])).toBe("a\tb c d");
    expect(
      csvOf([
        ["a", 'say "x", y'],
        ["=1+1", "-5"],
      ]),
    ).toBe('a,"say ""x"", y"\r\n\'=1+1,-5\r\n');
  });
});
