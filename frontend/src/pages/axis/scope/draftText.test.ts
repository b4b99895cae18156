import { describe, expect, it } from "vitest";
import { type Draft, FIRST } from "./draft";
import { draftOfText, draftText } from "./draftText";

const DRAFTS: Draft[] = [
  FIRST,
  { ...FIRST, kind: "edge", signal: "wtg-07/blade-1/pmc/6064", level: -3.25, slope: "falling", totalS: 4 },
  { ...FIRST, kind: "level", signal: "wtg-07/blade-1/pmm/3110:01", side: "below", preS: 0, mode: "normal" },
  { ...FIRST, kind: "event", event: "bit", signal: "wtg-07/blade-2/pmc/6041.3", holdOffS: 1.5 },
  { ...FIRST, kind: "fault", device: "wtg-07/blade-3/pmc", code: "8611h", mode: "auto", autoS: 7 },
];

describe("the trigger in a link", () => {
  it("comes back as it was, on whichever turbine", () => {
    for (const draft of DRAFTS) expect(draftOfText(draftText(draft), "wtg-07")).toEqual(draft);
    const [, edge] = DRAFTS;
    expect(edge && draftOfText(draftText(edge), "wtg-12")?.signal).toBe("wtg-12/blade-1/pmc/6064");
  });

  it("says only what is not the usual", () => {
    expect(draftText(FIRST)).toBe("manual");
    expect(draftText(DRAFTS[1] ?? FIRST)).toBe(
      "edge;signal:blade-1/pmc/6064;level:-3.25;total:4;slope:falling",
    );
  });

  it("takes of a damaged one what makes sense", () => {
    expect(draftOfText(undefined, "wtg-07")).toBeNull();
    expect(draftOfText("sideways;total:3", "wtg-07")).toBeNull();
    expect(draftOfText("edge;slope:sideways;total:x;pre:2;what;:;mode:auto", "wtg-07")).toEqual({
      ...FIRST,
      kind: "edge",
      preS: 2,
      mode: "auto",
    });
    expect(draftOfText("edge;signal:blade-1/pmc/6064", undefined)?.signal).toBeNull();
  });
});
