import { describe, expect, it } from "vitest";
import type { Place } from "../../ui/devices";
import { besideOf, kindsOf, selectionOf } from "./selection";

const place = (blade: number, kind: string) =>
  ({
    station: { slug: `wtg-07/blade-${blade}` },
    device: {
      slug: `wtg-07/blade-${blade}/${kind}`,
      description_id: `oat-${kind}`,
      name: kind.toUpperCase(),
    },
  }) as Place;
const PLACES = [1, 2, 3].flatMap((blade) => [place(blade, "pmm"), place(blade, "pmc")]);

describe("the devices shown", () => {
  it("are those of the URL, or the first", () => {
    expect(selectionOf(PLACES, "wtg-07/blade-2/pmc", undefined)?.active.device.slug).toBe(
      "wtg-07/blade-2/pmc",
    );
    expect(selectionOf(PLACES, "nothing", undefined)?.active.device.slug).toBe("wtg-07/blade-1/pmm");
    expect(selectionOf([], undefined, undefined)).toBeNull();
  });

  it("stand side by side only where there are several of a kind", () => {
    expect(selectionOf(PLACES, "wtg-07/blade-2/pmc", "side")?.kind.places).toHaveLength(3);
    expect(selectionOf([place(1, "pmm")], undefined, "side")?.side).toBe(false);
  });

  it("change the kind at the same station", () => {
    const [pmm] = kindsOf(PLACES);
    expect(pmm && besideOf(pmm, place(3, "pmc"))?.device.slug).toBe("wtg-07/blade-3/pmm");
  });
});
