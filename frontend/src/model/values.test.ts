import { describe, expect, it } from "vitest";
import type { DescriptionDoc, EntryDoc } from "../api/types";
import { fieldMax, fieldOf, setBits, withField } from "./bits";
import {
  defaultOf,
  inForce,
  limitsOf,
  type Lookup,
  Misfit,
  misfitOf,
  ownLimitsOf,
  parse,
  quantityOf,
  restsOn,
  show,
} from "./values";

const PLAIN: EntryDoc = {
  address: "3110:01",
  name: "warning level",
  object_name: "temperature supervisor battery",
  title: "temperature supervisor battery: warning level",
  kind: "record",
  type: "INTEGER16",
  bit_count: 16,
  range: [-32768, 32767],
  access: "rw",
  readable: true,
  writable: true,
  default: 500,
  node_id: false,
  saved: true,
  group: "temperatures",
  section: "4.6",
  unit: "°C",
  scale: 0.1,
  decimals: 1,
  unit_from: null,
  minimum: 100,
  maximum: 700,
  enumeration: null,
  bits: null,
  restore: "copy",
  verify: "equal",
  requires: [],
  note: null,
  save_category: null,
  by_variant: {},
  inferred: false,
  unproven: [],
  origin: null,
  motion: false,
  also: [],
  enumeration_from: null,
  bits_from: null,
  limits_from: null,
  step: 1,
  only: [],
  hexadecimal: false,
  ipv4: false,
  pdo: false,
};

const DOC: DescriptionDoc = {
  id: "test",
  version: "1",
  name: "test",
  vendor: "",
  bus: "canopen",
  manual: "",
  groups: [],
  bit_tables: {},
  enumerations: {
    type: { exclusive: true, values: [{ value: 161, name: "lithium", text_key: "enum.type.lithium" }] },
    open: { exclusive: false, values: [{ value: 1, name: "one", text_key: "enum.open.one" }] },
  },
  errors: [],
  entries: [],
  save: [],
  variant_matches: [],
  sources: {},
  state_machine: null,
};

const nothing: Lookup = () => null;
const raw = (entry: EntryDoc, text: string, lookup = nothing) => parse(DOC, entry, text, lookup);
const of = (change: Partial<EntryDoc>): EntryDoc => ({ ...PLAIN, ...change });
const UNSIGNED32 = of({
  type: "UNSIGNED32",
  bit_count: 32,
  range: [0, 4294967295],
  minimum: null,
  maximum: null,
});

describe("show", () => {
  it("gives as many decimals as the scale has, with the comma of the language", () => {
    expect(show(PLAIN, 500, nothing, "en")).toBe("50.0");
    expect(show(PLAIN, 505, nothing, "de")).toBe("50,5");
    expect(show(PLAIN, -5, nothing, "en")).toBe("-0.5");
    expect(show(PLAIN, 0, nothing, "en")).toBe("0.0");
  });

  it("shows masks and hexadecimal objects in the width of their type, negative ones as their bit pattern", () => {
    expect(show(of({ hexadecimal: true }), -1, nothing, "en")).toBe("FFFFh");
    expect(show({ ...UNSIGNED32, bits: "mask" }, 0xdeadbeef, nothing, "en")).toBe("DEADBEEFh");
    expect(
      show(of({ type: "BOOLEAN", bit_count: 1, range: [0, 1], hexadecimal: true }), 1, nothing, "en"),
    ).toBe("01h");
  });

  it("shows octets in pairs and texts as they are", () => {
    const octets = of({ type: "OCTET_STRING", bit_count: null, range: null });
    expect(show(octets, "0aff", nothing, "en")).toBe("0A FF");
    expect(show(of({ type: "VISIBLE_STRING", bit_count: null, range: null }), "PMC 1.5", nothing, "de")).toBe(
      "PMC 1.5",
    );
  });
});

describe("parse", () => {
  it("reads point and comma, with and without the unit", () => {
    for (const text of ["49.5", "49,5", " 49.5 °C ", "49,5°C", "+49.5", "raw:495", "1EFh", "0x1ef"]) {
      expect(raw(PLAIN, text), text).toEqual({ ok: true, raw: 495 });
    }
  });

  it("is exact where floating point is not", () => {
    const fine = of({ scale: 0.1, minimum: null, maximum: null });
    for (let tenths = -2000; tenths <= 2000; tenths += 1) {
      const text = show(fine, tenths, nothing, "de");
      expect(raw(fine, text)).toEqual({ ok: true, raw: tenths });
    }
  });

  it("refuses what lies between two raw values instead of rounding it", () => {
    expect(raw(PLAIN, "49.55")).toEqual({ ok: false, why: Misfit.Resolution });
    expect(raw(of({ scale: 1, unit: "" }), "100.5")).toEqual({ ok: false, why: Misfit.Resolution });
  });

  it("names the side of the limit", () => {
    expect(raw(PLAIN, "70.0")).toEqual({ ok: true, raw: 700 });
    expect(raw(PLAIN, "70.1")).toEqual({ ok: false, why: Misfit.AboveLimit });
    expect(raw(PLAIN, "9.9")).toEqual({ ok: false, why: Misfit.BelowLimit });
    expect(raw(UNSIGNED32, "raw:4294967296")).toEqual({ ok: false, why: Misfit.AboveLimit });
  });

  it("refuses other units, no numbers and nothing", () => {
    expect(raw(PLAIN, "49.5 K")).toEqual({ ok: false, why: Misfit.Unit });
    expect(raw(PLAIN, "warm")).toEqual({ ok: false, why: Misfit.NoNumber });
    expect(raw(PLAIN, "1.2.3")).toEqual({ ok: false, why: Misfit.Unit });
    expect(raw(PLAIN, "")).toEqual({ ok: false, why: Misfit.Empty });
  });

  it("shows addresses of the internet as four numbers, and reads them so", () => {
    const address = of({
      type: "UNSIGNED32",
      bit_count: 32,
      range: [0, 4294967295],
      hexadecimal: true,
      ipv4: true,
    });
    const open = { ...address, decimals: 0, unit: "", scale: 1, minimum: null, maximum: null };
    expect(show(open, 3232236052, nothing, "de")).toBe("192.168.2.20");
    expect(show(open, 0, nothing, "en")).toBe("0.0.0.0");
    for (const typed of ["192.168.2.20", " 192.168.2.20 ", "C0A80214h", "3232236052"])
      expect(parse(DOC, open, typed, nothing)).toEqual({ ok: true, raw: 3232236052 });
    for (const typed of ["192.168.2", "192.168.2.256", "192.168.2.020", "192.168.2.20.1", "a.b.c.d"])
      expect(parse(DOC, open, typed, nothing)).toEqual({ ok: false, why: Misfit.NoAddress });
  });

  it("takes a hexadecimal number as a bit pattern of the type", () => {
    const free = of({ minimum: null, maximum: null });
    expect(raw(free, "FFFFh")).toEqual({ ok: true, raw: -1 });
    expect(raw(UNSIGNED32, "FFFFFFFFh")).toEqual({ ok: true, raw: 4294967295 });
  });

  it("keeps integers beyond 2^53 exact, as digits", () => {
    const wide = of({
      type: "UNSIGNED64",
      bit_count: 64,
      range: [0, 2 ** 64],
      decimals: 0,
      scale: 1,
      unit: "",
      minimum: null,
      maximum: null,
    });
    expect(raw(wide, "9007199254740993")).toEqual({ ok: true, raw: "9007199254740993" });
    expect(show(wide, "9007199254740993", nothing, "en")).toBe("9007199254740993");
    expect(show({ ...wide, hexadecimal: true }, "18446744073709551615", nothing, "en")).toBe(
      "FFFFFFFFFFFFFFFFh",
    );
  });

  it("holds to an exclusive enumeration and lets an open one be", () => {
    const free = of({ scale: 1, unit: "", minimum: null, maximum: null });
    expect(raw({ ...free, enumeration: "type" }, "raw:161")).toEqual({ ok: true, raw: 161 });
    expect(raw({ ...free, enumeration: "type" }, "7")).toEqual({ ok: false, why: Misfit.NotListed });
    expect(raw({ ...free, enumeration: "open" }, "7")).toEqual({ ok: true, raw: 7 });
  });

  it("reads octets and texts", () => {
    const octets = of({ type: "OCTET_STRING", bit_count: null, range: null });
    expect(raw(octets, "0a FF")).toEqual({ ok: true, raw: "0aff" });
    expect(raw(octets, "0aF")).toEqual({ ok: false, why: Misfit.NoHex });
    const text = of({ type: "VISIBLE_STRING", bit_count: null, range: null });
    expect(raw(text, "Größe")).toEqual({ ok: false, why: Misfit.NotAscii });
    expect(raw(text, "rotor")).toEqual({ ok: true, raw: "rotor" });
  });
});

describe("what rests on other objects", () => {
  const known =
    (values: Record<string, number>): Lookup =>
    (address) =>
      values[address] ?? null;

  it("takes limits of other objects where they are known, else those of the type", () => {
    const entry = of({ maximum: { address: "3110:02", factor: 1 } });
    expect(parse(DOC, of({ minimum: 60, also: [0], scale: 1 }), "0", nothing)).toEqual({ ok: true, raw: 0 });
    expect(limitsOf(entry, nothing)).toEqual({ low: 100, high: 32767 });
    expect(limitsOf(entry, known({ "3110:02": 600 }))).toEqual({ low: 100, high: 600 });
    expect(raw(entry, "60.1", known({ "3110:02": 600 }))).toEqual({ ok: false, why: Misfit.AboveLimit });
  });

  it("shows positions in degrees by feed and shaft revolutions", () => {
    const entry = of({
      scale: 0.01,
      unit: "°",
      decimals: 2,
      unit_from: { address: "6092:01", shaft: "6092:02", choices: {} },
      minimum: null,
      maximum: null,
    });
    const feed = known({ "6092:01": 3600, "6092:02": 1 });
    expect(show(entry, 800, nothing, "en")).toBe("8.00");
    expect(show(entry, 800, feed, "en")).toBe("80.00");
    expect(raw(entry, "80.0", feed)).toEqual({ ok: true, raw: 800 });
    expect(quantityOf(entry, known({ "6092:01": 0, "6092:02": 1 })).scale).toEqual({ num: 1n, den: 100n });
  });

  it("adds the node's number to a default that asks for it", () => {
    expect(defaultOf(of({ default: 0x600, node_id: true }), 12)).toBe(0x60c);
    expect(defaultOf(of({ default: { hex: "0A0B" } }), 12)).toBe("0a0b");
    expect(defaultOf(of({ default: null }), 12)).toBeNull();
  });
});

describe("bits", () => {
  const bit = (first: number, last = first) => ({
    bit: first,
    last,
    name: `b${first}`,
    text_key: `b${first}`,
    clamp: null,
    error_code: null,
  });

  it("sets and clears one bit and leaves all others, the highest of 32 too", () => {
    const all = withField(UNSIGNED32, 0, bit(31), 1);
    expect(all).toBe(0x80000000);
    expect(withField(UNSIGNED32, 0xffffffff, bit(0), 0)).toBe(0xfffffffe);
    expect(fieldOf(UNSIGNED32, 0xffffffff, bit(31))).toBe(1);
  });

  it("keeps the sign of signed types", () => {
    expect(withField(PLAIN, 0, bit(15), 1)).toBe(-32768);
    expect(withField(PLAIN, -1, bit(15), 0)).toBe(32767);
  });

  it("reads and writes fields of several bits", () => {
    expect(fieldMax(bit(4, 6))).toBe(7);
    expect(fieldOf(UNSIGNED32, 0b1010000, bit(4, 6))).toBe(5);
    expect(withField(UNSIGNED32, 0b1111111, bit(4, 6), 2)).toBe(0b0101111);
  });

  it("names the bits that are set", () => {
    expect(setBits(UNSIGNED32, 0b101, [bit(0), bit(1), bit(2)]).map((one) => one.bit)).toEqual([0, 2]);
  });
});

describe("what rests on the value of another object", () => {
  const ruled: EntryDoc = {
    ...PLAIN,
    minimum: 0,
    maximum: 9,
    enumeration: "all",
    bits: null,
    enumeration_from: { address: "1/22", choices: { "67": "analog" } },
    limits_from: { address: "1/22", choices: { "67": { minimum: 100, maximum: 200 } } },
  };
  const of = (raw: number | null) => (address: string) => (address === "1/22" ? raw : null);

  it("is what that value chooses", () => {
    expect(inForce(ruled, of(67))).toMatchObject({ enumeration: "analog", minimum: 100, maximum: 200 });
    expect(ownLimitsOf(ruled, of(67))).toEqual({ low: 100, high: 200 });
  });

  it("is what holds in all cases where that value is unknown or chooses nothing", () => {
    expect(inForce(ruled, of(null))).toMatchObject({ enumeration: "all", minimum: 0, maximum: 9 });
    expect(ownLimitsOf(ruled, of(64))).toEqual({ low: 0, high: 9 });
  });

  it("is told as what the object rests on", () => {
    expect(restsOn(ruled)).toEqual(["1/22"]);
    expect(inForce(PLAIN, of(67))).toBe(PLAIN);
  });
});

describe("raw values that there are", () => {
  const doc = { enumerations: {} } as unknown as DescriptionDoc;
  const why = (entry: EntryDoc, raw: number) => misfitOf(doc, entry, raw, () => null);
  const open: EntryDoc = { ...PLAIN, minimum: null, maximum: null, enumeration: null };

  it("are multiples of the step", () => {
    expect(why({ ...open, step: 2 }, 4)).toBeNull();
    expect(why({ ...open, step: 2 }, 5)).toBe(Misfit.Resolution);
  });

  it("are those of the list", () => {
    expect(why({ ...open, only: [20, 25] }, 25)).toBeNull();
    expect(why({ ...open, only: [20, 25] }, 21)).toBe(Misfit.NotListed);
  });
});
