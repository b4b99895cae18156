import { describe, expect, it } from "vitest";
import type { SetRecord } from "../../../api/types";
import { columnsOf, pickedOf, restorable, toggled } from "./selection";

const record = (id: string, device: string) =>
  ({
    id,
    description_id: device.endsWith("pmc") ? "oat-pmc" : "oat-pmm",
    origin: { device },
  }) as unknown as SetRecord;
const PMM = record("1", "wtg-07/blade-1/pmm");
const PMC = record("2", "wtg-07/blade-1/pmc");
const OTHER = record("3", "wtg-07/blade-2/pmc");

describe("sets that are picked", () => {
  it("stand in the URL", () => {
    expect(pickedOf({})).toEqual([]);
    expect(toggled(["1"], "2")).toBe("1,2");
    expect(toggled(["1", "2"], "1")).toBe("2");
    expect(toggled(["1"], "1")).toBeUndefined();
  });

  it("are compared with each other, one alone with the device now", () => {
    expect(columnsOf([PMM, PMC])).toBe("set:1,set:2");
    expect(columnsOf([PMC])).toBe("set:2,live:wtg-07/blade-1/pmc");
  });

  it("are restored where they are of one station, one a device", () => {
    expect(restorable([PMM, PMC])).toBe("wtg-07/blade-1");
    expect(restorable([PMC])).toBe("wtg-07/blade-1");
    expect(restorable([PMM, OTHER])).toBeNull();
    expect(restorable([PMC, record("4", "wtg-07/blade-1/pmc")])).toBeNull();
    expect(restorable([])).toBeNull();
  });
});
