import { readFileSync } from "node:fs";
import { parse } from "smol-toml";
import { describe, expect, it } from "vitest";
import type { TraceItem, TraceLine } from "../../api/trace";
import { translator } from "../../texts/texts";
import { filterOf, GROUPS, isFiltered, listOf } from "./filter";
import {
  bytesOf,
  exactTime,
  idText,
  isCan,
  meaningText,
  partnerOf,
  serviceText,
  shownBytes,
  valueText,
} from "./lines";

function flat(table: Record<string, unknown>, prefix = ""): Record<string, string> {
  return Object.fromEntries(
    Object.entries(table).flatMap(([key, value]) =>
      typeof value === "string"
        ? [[prefix + key, value]]
        : Object.entries(flat(value as Record<string, unknown>, `${prefix}${key}.`)),
    ),
  );
}

const texts = (language: "en" | "de") =>
  translator(
    flat(parse(readFileSync(new URL(`../../../../app/locales/${language}.toml`, import.meta.url), "utf-8"))),
    language,
  );
const en = texts("en");
const de = texts("de");

const item = (parts: Partial<TraceItem>): TraceItem => ({
  address: "6064",
  name: null,
  sub: null,
  text: null,
  unit: "",
  key: null,
  bits: [],
  ...parts,
});

const line = (parts: Partial<TraceLine>): TraceLine =>
  ({
    t_ns: 1,
    bus: "can0",
    node: 11,
    items: [],
    notes: [],
    step: null,
    start_t_ns: null,
    transaction: null,
    peer: null,
    fdl: null,
    ...parts,
  }) as TraceLine;

describe("a row of PROFIBUS", () => {
  const fdl = { source: 2, destination: 6, dsap: null, ssap: null, pkw: true, sound: true };
  const telegram = line({ service: "fdl-same", number: 0, fdl, data: "e5" });

  it("names its ends and its service", () => {
    expect(idText(telegram)).toBe("2→6");
    expect(idText(line({ fdl: { ...fdl, source: null, destination: null } }))).toBe("–→–");
    expect(serviceText(telegram, en)).toBe("DP unchanged");
    expect(serviceText(telegram, de)).toBe("DP unverändert");
    expect(shownBytes(telegram)).toEqual(["E5"]);
    expect(shownBytes({ ...telegram, data: "680404680602 5d aa 0016".replaceAll(" ", "") })).toEqual(["AA"]);
    expect(shownBytes({ ...telegram, fdl: { ...fdl, sound: false }, data: "6804" })).toEqual(["68", "04"]);
    expect([isCan(telegram), isCan(line({}))]).toEqual([false, true]);
  });

  it("is in the filter with and without what brings nothing new", () => {
    expect(filterOf({ services: "profibus" }).services).toEqual(["fdl-request", "fdl-response"]);
    expect(GROUPS.cyclic).toContain("fdl-same");
  });
});

describe("a row of Modbus TCP", () => {
  const adu = line({ service: "modbus-response", number: 43, transaction: 17, data: "001100000003002b0d00" });

  it("names its transaction, its function and the bytes behind the header", () => {
    expect(idText(adu)).toBe("#17");
    expect(serviceText(adu, en)).toBe("FC 43 resp");
    expect(serviceText(adu, de)).toBe("FC 43 Antw.");
    expect(shownBytes(adu)).toEqual(["2B", "0D", "00"]);
  });
});

describe("a row in words", () => {
  it("shows identifiers and bytes as they are printed", () => {
    expect(idText({ can_id: 0x8b, extended: false })).toBe("08B");
    expect(idText({ can_id: 0x8b, extended: true })).toBe("0000008B");
    expect(bytesOf("4b60")).toEqual(["4B", "60"]);
    expect(bytesOf("")).toEqual([]);
  });

  it("numbers PDOs only", () => {
    expect(serviceText({ service: "tpdo", number: 2 }, en)).toBe("TPDO2");
    expect(serviceText({ service: "heartbeat", number: 0 }, de)).toBe("Heartbeat");
  });

  it("gives values their unit and the manner of the language", () => {
    expect(valueText(item({ text: "49.0", unit: "°C" }), en)).toBe("49.0 °C");
    expect(valueText(item({ text: "49.0", unit: "°C" }), de)).toBe("49,0 °C");
    expect(valueText(item({ text: "V1.2.3" }), de)).toBe("V1.2.3");
    expect(valueText(item({}), en)).toBe("");
  });

  it("says step, object, value and remark", () => {
    const refused = line({
      step: "abort",
      items: [item({ name: "following error window" })],
      notes: [{ key: "trace.note.abort", details: { code_hex: "06010002h", reason_key: "abort.read_only" } }],
    });
    expect(meaningText(refused, en)).toBe(
      "ABORT · 6064 following error window · 06010002h The object can only be read",
    );
    expect(meaningText(refused, de)).toContain("ABBRUCH · 6064 Schleppfehlerfenster");
  });

  it("knows a time to the microsecond", () => {
    expect(exactTime(1_700_000_000_123_456_768)).toMatch(/:20\.123456$/);
  });
});

describe("request and answer", () => {
  const asked = line({ t_ns: 5 });
  const other = line({ t_ns: 6, node: 12, start_t_ns: 4 });
  const given = line({ t_ns: 9, start_t_ns: 5 });

  it("find each other", () => {
    expect(partnerOf(given, [asked, other, given])).toBe(asked);
    expect(partnerOf(asked, [asked, other, given])).toBe(given);
    expect(partnerOf(asked, [asked, other])).toBeUndefined();
  });
});

describe("the filter of an address", () => {
  it("stands for the services of its groups", () => {
    const filter = filterOf({ nodes: "1,11,x", services: "sdo,emcy", dir: "tx", errors: "1", q: "bat" });
    expect(filter).toEqual({
      nodes: [1, 11],
      services: ["sdo-request", "sdo-response", "emcy"],
      direction: "tx",
      ids: "",
      data: "",
      q: "bat",
      errors: true,
    });
    expect(isFiltered({ dir: "tx" })).toBe(true);
    expect(isFiltered({ paused: "1" })).toBe(false);
    expect(listOf(undefined)).toEqual([]);
  });

  it("has words for every group and service, in both languages", () => {
    for (const t of [en, de])
      for (const [group, services] of Object.entries(GROUPS)) {
        expect(t.has(`trace.group.${group}`)).toBe(true);
        expect(services.filter((one) => !t.has(`trace.service.${one}`))).toEqual([]);
      }
  });
});
