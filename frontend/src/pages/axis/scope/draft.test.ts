import { describe, expect, it } from "vitest";
import { codeOf, FIRST, orderOf } from "./draft";

const SIGNALS = ["a/b/pmc/6064"];

describe("the order of a draft", () => {
  it("holds of the trigger only what its kind needs", () => {
    expect(orderOf(FIRST, SIGNALS)?.trigger).toEqual({ kind: "manual" });
    const edge = { ...FIRST, kind: "edge" as const, signal: "a/b/pmc/6064", level: -3 };
    expect(orderOf(edge, SIGNALS)?.trigger).toEqual({
      kind: "edge",
      signal: "a/b/pmc/6064",
      level: -3,
      slope: "rising",
    });
    const fault = { ...FIRST, kind: "fault" as const, code: "8611h" };
    expect(orderOf(fault, SIGNALS)?.trigger).toEqual({ kind: "fault", device: null, code: 0x8611 });
  });

  it("is none where something is missing", () => {
    expect(orderOf(FIRST, [])).toBeNull();
    expect(orderOf({ ...FIRST, kind: "edge" }, SIGNALS)).toBeNull();
    expect(orderOf({ ...FIRST, kind: "event", event: "bit" }, SIGNALS)).toBeNull();
    expect(orderOf({ ...FIRST, kind: "fault", code: "xyz" }, SIGNALS)).toBeNull();
  });

  it("reads codes as manuals print them", () => {
    expect([codeOf(""), codeOf("3120"), codeOf("8611H"), codeOf("0"), codeOf("12345")]).toEqual([
      null,
      0x3120,
      0x8611,
      undefined,
      undefined,
    ]);
  });
});
