import { describe, expect, it } from "vitest";
import type { DescriptionDoc, EntryDoc } from "../api/types";
import { translator } from "../texts/texts";
import { filterRows, linesOf, rowsOf } from "./rows";

function entry(change: Partial<EntryDoc>): EntryDoc {
  const plain = { name: "level", object_name: "battery", kind: "var", unit: "", group: "a", access: "rw" };
  return { ...plain, enumeration: null, bits: null, title: "", ...change } as EntryDoc;
}

const DOC = {
  groups: [{ id: "b" }, { id: "a" }],
  bit_tables: {
    mask: [{ bit: 0, last: 0, name: "fan", text_key: "bit.fan", clamp: "X16.1", error_code: null }],
  },
  enumerations: {
    kind: { exclusive: true, values: [{ value: 1, name: "lithium", text_key: "enum.lithium" }] },
  },
  entries: [
    entry({ address: "3110:01", kind: "record", unit: "°C" }),
    entry({ address: "3201:04", name: "output", group: "b", bits: "mask" }),
    entry({ address: "3000", name: "type", enumeration: "kind" }),
    entry({ address: "3001", name: "stray", group: "c" }),
  ],
} as unknown as DescriptionDoc;

const t = translator(
  {
    "group.a": "Batterie",
    "group.b": "Klemmen",
    "name.level": "Warngrenze",
    "name.battery": "Batterie",
    "bit.fan": "Lüfter",
    "enum.lithium": "Lithium-Ionen",
  },
  "de",
);
const rows = rowsOf(DOC, t);
const found = (filter: string) => filterRows(rows, filter).map((row) => row.entry.address);

describe("filter", () => {
  it("finds addresses, translated and English names, units, groups", () => {
    expect(found("3110")).toEqual(["3110:01"]);
    expect(found("warngrenze")).toEqual(["3110:01"]);
    expect(found("°c")).toEqual(["3110:01"]);
    expect(found("klemmen")).toEqual(["3201:04"]);
  });

  it("finds texts of bits, clamps and enumerations", () => {
    expect(found("lüfter")).toEqual(["3201:04"]);
    expect(found("x16.1")).toEqual(["3201:04"]);
    expect(found("lithium")).toEqual(["3000"]);
  });

  it("wants every word, in any order, and keeps all for nothing", () => {
    expect(found("rw 3110")).toEqual(["3110:01"]);
    expect(found("3110 klemmen")).toEqual([]);
    expect(found("  ")).toHaveLength(4);
  });

  it("answers within a frame over 5,000 rows", () => {
    const many = Array.from({ length: 5000 }, (_, at) => ({ ...rows[at % 4], order: at })) as typeof rows;
    const begun = performance.now();
    for (let round = 0; round < 10; round += 1) filterRows(many, "batterie warn 31");
    expect((performance.now() - begun) / 10).toBeLessThan(16);
  });
});

describe("groups", () => {
  it("follow the order of the description; what it does not name comes last", () => {
    const heads = linesOf(rows, ["b", "a"], new Set()).filter((line) => line.kind === "group");
    expect(heads.map((head) => [head.id, head.count])).toEqual([
      ["b", 1],
      ["a", 2],
      ["c", 1],
    ]);
  });

  it("hide their rows when closed and vanish when empty", () => {
    const lines = linesOf(filterRows(rows, "batterie"), ["b", "a"], new Set(["a"]));
    expect(lines.map((line) => line.kind)).toEqual(["group"]);
  });

  it("keep the order of the rows they are given", () => {
    const lines = linesOf([...rows].reverse(), ["a"], new Set());
    const addresses = lines.flatMap((line) => (line.kind === "entry" ? [line.row.entry.address] : []));
    expect(addresses).toEqual(["3000", "3110:01", "3001", "3201:04"]);
  });
});
