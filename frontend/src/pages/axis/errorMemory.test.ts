import { describe, expect, it } from "vitest";
import type { Raw } from "../../api/types";
import { MEMORY, memoryOf, piecesOf } from "./errorMemory";

const lookupIn = (values: Record<string, Raw>) => (address: string) => values[address] ?? null;

describe("the error memory", () => {
  it("is not known before its number of entries is", () => {
    expect(memoryOf(lookupIn({ "1003:01": 0x8611 }))).toBeNull();
    expect(memoryOf(lookupIn({ "1003": 0 }))).toEqual([]);
  });

  it("holds the code in the low word, and says what was not read", () => {
    const read = memoryOf(lookupIn({ "1003": 2, "1003:01": 0x12348611, "2030:01": 77 }));
    expect(read?.map(({ at, code, stamp }) => ({ at, code, stamp }))).toEqual([
      { at: 1, code: 0x8611, stamp: 77 },
      { at: 2, code: null, stamp: null },
    ]);
  });

  it("reads eight entries with their stamps and no more", () => {
    expect(MEMORY).toHaveLength(17);
    const full = Object.fromEntries(MEMORY.map((address) => [address, 1]));
    expect(memoryOf(lookupIn({ ...full, "1003": 200 }))).toHaveLength(8);
  });

  it("keeps the key of an error that newer ones push down, also of one that is there twice", () => {
    const before = memoryOf(lookupIn({ "1003": 2, "1003:01": 5, "2030:01": 9, "1003:02": 5, "2030:02": 9 }));
    const after = memoryOf(
      lookupIn({
        "1003": 3,
        "1003:01": 7,
        "2030:01": 9,
        "1003:02": 5,
        "2030:02": 9,
        "1003:03": 5,
        "2030:03": 9,
      }),
    );
    expect(new Set(after?.map((one) => one.key)).size).toBe(3);
    expect(after?.slice(1).map((one) => one.key)).toEqual(before?.map((one) => one.key));
  });
});

describe("objects in a text", () => {
  const known = (address: string) => ["6065", "6510:04", "3110:01"].includes(address);
  const marked = (text: string) =>
    piecesOf(text, known).map((one) => (one.address === null ? one.text : `<${one.address}|${one.text}>`));

  it("are found with and without sub-index, and nothing of the text is lost", () => {
    const text = "Above 6065h for long; 6510:04 too.";
    expect(marked(text)).toEqual(["Above ", "<6065|6065h>", " for long; ", "<6510:04|6510:04>", " too."]);
    const all = piecesOf(text, known);
    expect(all.map((one) => one.text).join("")).toBe(text);
  });

  it("are not error codes, clamps, figures or objects that the device has not", () => {
    const text = "3110h is a code, 8000 mA a figure, X16.1 a clamp, 9999h unknown, 16065h none.";
    expect(marked(text)).toEqual([text]);
  });

  it("may stand at both ends", () => {
    expect(marked("6065h/3110:01")).toEqual(["<6065|6065h>", "/", "<3110:01|3110:01>"]);
    expect(marked("")).toEqual([]);
  });
});
