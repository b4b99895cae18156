import { describe, expect, it } from "vitest";
import { changed, moved, parseView, usualView, viewText, withoutSignal, withSignal } from "./view";

const A = "blade-1/pmc/6064";
const B = "blade-2/pmm/3110:01";

describe("a view", () => {
  it("is read from a link as it was written", () => {
    const plots = [
      { signals: [A, B], band: true, range: null },
      { signals: [B], band: false, range: [-2.5, 7] as const },
    ];
    expect(viewText(plots)).toBe(`band!${A},${B};${B}@-2.5..7`);
    expect(parseView(viewText(plots))).toEqual(plots);
  });

  it("is opened from a damaged link as far as it goes", () => {
    expect(parseView(`;x;${A},nothing,${A}@7..-1`)).toEqual([{ signals: [A], band: false, range: null }]);
  });

  it("is by itself what was seen of demand, position, DC link, battery and following error", () => {
    const seen = ["blade-2/pmc/6064", "blade-1/pmc/6064", "blade-1/pmc/607A", "blade-1/pmm/3063"];
    expect(usualView(new Set(seen)).map((plot) => [plot.signals, plot.band])).toEqual([
      [["blade-1/pmc/6064", "blade-2/pmc/6064", "blade-1/pmc/607A"], true],
      [["blade-1/pmm/3063"], false],
    ]);
  });

  it("takes signals in and out, and its plots change places", () => {
    const one = withSignal([], A, null);
    const two = withSignal(withSignal(one, B, null), B, 0);
    expect(two.map((plot) => plot.signals)).toEqual([[A, B], [B]]);
    expect(withSignal(two, B, 0)).toEqual(two);
    expect(moved(two, 1, 0).map((plot) => plot.signals)).toEqual([[B], [A, B]]);
    expect(moved(two, 1, 2)).toEqual(two);
    expect(withoutSignal(two, B, 1).map((plot) => plot.signals)).toEqual([[A, B]]);
    expect(changed(two, 1, { range: [0, 1] })[1]?.range).toEqual([0, 1]);
  });
});
