import { describe, expect, it } from "vitest";
import type { FaultKind, FaultParameter } from "../../api/instructor";
import { fieldsOf, flawOf, limitsOf, numberOf, numberText, orderOf, textOf, typedOf } from "./draft";

const parameter = (change: Partial<FaultParameter> = {}): FaultParameter => ({
  name: "percent",
  unit: "%",
  low: 0.1,
  high: 100,
  default: 20,
  integer: false,
  ...change,
});

const kind = (change: Partial<FaultKind> = {}): FaultKind => ({
  id: "frames_lost",
  level: "wire",
  target: "bus",
  momentary: false,
  parameters: [parameter()],
  ...change,
});

const NOWHERE = { blade: null, node: null };

describe("what is typed", () => {
  it("goes to the URL and back as it was typed", () => {
    const typed = new Map([
      ["percent", "1,5"],
      ["for", "10"],
    ]);
    expect(textOf(typed)).toBe("percent:1,5;for:10");
    expect(typedOf(textOf(typed))).toEqual(typed);
    expect(typedOf("")).toEqual(new Map());
    expect(typedOf("nonsense;:3;a:1")).toEqual(new Map([["a", "1"]]));
  });

  it("is read with a decimal comma and in hexadecimal", () => {
    expect(["1.5", "1,5", "-3", "0x60FB", "60FBh"].map(numberOf)).toEqual([1.5, 1.5, -3, 0x60fb, 0x60fb]);
    expect(["", "a", "1.2.3", "1e3", "NaN", "h"].map(numberOf)).toEqual([null, null, null, null, null, null]);
  });

  it("is measured by the limits, which belong to it", () => {
    expect(["0.1", "100"].map((text) => flawOf(parameter(), text))).toEqual([null, null]);
    expect(["0", "100.1", "-5"].map((text) => flawOf(parameter(), text))).toEqual([
      "range",
      "range",
      "range",
    ]);
    expect(flawOf(parameter(), "much")).toBe("no_number");
    expect(flawOf(parameter({ integer: true }), "1.5")).toBe("not_whole");
  });
});

describe("numbers as people know them", () => {
  it("are hexadecimal for identifiers and have a comma in German", () => {
    expect(numberText(parameter({ name: "can_id", high: 0x7ff }), 0x10, "en")).toBe("010h");
    expect(numberText(parameter(), 0.1, "de")).toBe("0,1");
    expect(limitsOf(parameter(), "de")).toBe("0,1 … 100 %");
  });
});

describe("an order", () => {
  it("holds what was typed and leaves the rest to the defaults", () => {
    expect(orderOf(kind(), NOWHERE, new Map())).toEqual({
      kind: "frames_lost",
      blade: null,
      node: null,
      values: {},
      seconds: null,
    });
    const typed = typedOf("percent:30;for:2,5;other:7");
    expect(orderOf(kind(), { blade: null, node: 12 }, typed)).toEqual({
      kind: "frames_lost",
      blade: null,
      node: 12,
      values: { percent: 30 },
      seconds: 2.5,
    });
  });

  it("is none while a value or the duration is wrong", () => {
    expect(orderOf(kind(), NOWHERE, typedOf("percent:300"))).toBeNull();
    expect(orderOf(kind(), NOWHERE, typedOf("percent:"))).toBeNull();
    expect(orderOf(kind(), NOWHERE, typedOf("for:0"))).toBeNull();
    expect(orderOf(kind(), NOWHERE, typedOf("for:"))).not.toBeNull();
  });

  it("has no duration where the fault ends of itself", () => {
    const gust = kind({ momentary: true });
    expect(fieldsOf(gust).map(({ name }) => name)).toEqual(["percent"]);
    expect(orderOf(gust, NOWHERE, typedOf("for:3"))?.seconds).toBeNull();
  });
});
