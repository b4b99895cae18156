import { describe, expect, it } from "vitest";
import type { Motor, MotorForm } from "../../../api/motors";
import type { DescriptionDoc, EntryDoc } from "../../../api/types";
import { translator } from "../../../texts/texts";
import { disagreeing, draftOf, flawOf, typedOf } from "./motorDraft";
import { idOf, placeOf, sidesOf } from "./places";

const TEXTS = {
  "motor.flaw.missing": "missing",
  "motor.flaw.range": "{minimum} to {maximum} {unit}",
  "motor.flaw.decimals": "{decimals} decimals",
  "page.misfit.above": "at most {limits} {unit}",
  "page.misfit.no_number": "no number",
  "page.misfit.unit": "the unit is {unit}",
};
const en = translator(TEXTS, "en");
const de = translator(TEXTS, "de");

const entry = (address: string, own: Partial<EntryDoc>): EntryDoc =>
  ({
    address,
    name: address,
    object_name: address,
    kind: "var",
    type: "UNSIGNED16",
    bit_count: 16,
    range: [0, 65535],
    unit: "",
    scale: 1,
    decimals: 0,
    unit_from: null,
    minimum: null,
    maximum: null,
    also: [],
    enumeration_from: null,
    bits_from: null,
    limits_from: null,
    step: 1,
    only: [],
    enumeration: null,
    bits: null,
    requires: [],
    hexadecimal: false,
    restore: "copy",
    ...own,
  }) as EntryDoc;

const form: MotorForm = {
  plate: [
    { name: "power_kw", text: false, unit: "kW", minimum: 0.01, maximum: 1000, decimals: 2, address: null },
    { name: "current_a", text: false, unit: "A", minimum: 0.01, maximum: 4000, decimals: 3, address: "6076" },
    { name: "encoder", text: true, unit: "", minimum: null, maximum: null, decimals: 0, address: null },
  ],
  description: {
    id: "oat-pmc",
    enumerations: {
      kind: { exclusive: true, values: [{ value: 7, name: "asynchronous", text_key: "enum.asynchronous" }] },
    },
    bit_tables: {},
    entries: [
      entry("6402", { enumeration: "kind", hexadecimal: true }),
      entry("6073", { unit: "%", scale: 0.1, decimals: 1, maximum: 2000 }),
      entry("6076", { unit: "mA", type: "UNSIGNED32", bit_count: 32, range: [0, 4294967295] }),
    ],
  } as unknown as DescriptionDoc,
};

const motor = {
  id: "m",
  version: 1,
  maker: "Lorentz",
  type: "PM",
  plate: { power_kw: 5.5, current_a: 11.3, encoder: "sine" },
  values: { "6402": 7, "6073": 1505, "6076": 11300 },
  remarks: "x",
  invented: false,
} as unknown as Motor;

describe("the form of a motor", () => {
  it("begins with the motor and gives back the same, in either language", () => {
    const { plate, maker, type, remarks, values } = motor;
    for (const t of [en, de])
      expect(draftOf(form, typedOf(form, motor, t), t)).toEqual({ maker, type, remarks, values, plate });
    expect(typedOf(form, motor, de)).toMatchObject({ power_kw: "5,5", "6073": "150,5", "6402": "raw:7" });
  });

  it("leaves maker, type and remarks of an example for the person to type", () => {
    const typed = typedOf(form, { ...motor, invented: true }, en);
    expect([typed.maker, typed.type, typed.remarks, typed["6073"]]).toEqual([
      undefined,
      undefined,
      undefined,
      "150.5",
    ]);
    expect(draftOf(form, typed, en)).toBeNull();
  });

  it("names what does not fit", () => {
    const flaw = (name: string, text: string) => flawOf(form, name, { [name]: text }, de);
    expect(flaw("maker", " ")).toBe("missing");
    expect(flaw("remarks", "")).toBeNull();
    expect(flaw("power_kw", "1001")).toBe("0,01 to 1000 kW");
    expect(flaw("power_kw", "1,234")).toBe("2 decimals");
    expect(flaw("power_kw", "1,20")).toBeNull();
    expect(flaw("power_kw", "much")).toBe("no number");
    expect(flaw("power_kw", "")).toBeNull();
    expect(flaw("6073", "200,1")).toBe("at most 0,0 … 200,0 %");
    expect(flaw("6073", "10 A")).toBe("the unit is %");
    expect(flaw("6073", "")).toBeNull();
  });

  it("holds only what was typed", () => {
    const draft = draftOf(form, { maker: "A", type: "B", "6073": "" }, en);
    expect(draft).toMatchObject({ maker: "A", values: {}, plate: { power_kw: null, encoder: "" } });
  });

  it("notices a plate that says another number than its parameter", () => {
    const typed = typedOf(form, motor, en);
    expect(disagreeing(form, typed)).toEqual([]);
    expect(disagreeing(form, { ...typed, current_a: "11.2" }).map((one) => one.name)).toEqual(["current_a"]);
    expect(disagreeing(form, { ...typed, current_a: "11.2", "6076": "" })).toEqual([]);
  });
});

describe("what the address names", () => {
  it("is a motor in any of its versions", () => {
    expect(placeOf("id@3")).toEqual({ id: "id", version: 3 });
    expect(placeOf("id@x")).toEqual({ id: "id", version: null });
    expect(placeOf("id")).toEqual({ id: "id", version: null });
  });

  it("is two sides, of which either may be missing", () => {
    expect(sidesOf("motor:a,live:b")).toEqual(["motor:a", "live:b"]);
    expect(sidesOf(",")).toEqual(["", ""]);
    expect(idOf("motor:0197a000-0000-7000-8000-00000000e001@2")).toBe("0197a000-0000-7000-8000-00000000e001");
    expect(idOf("live:wtg-07/blade-1/pmc")).toBeUndefined();
  });
});
