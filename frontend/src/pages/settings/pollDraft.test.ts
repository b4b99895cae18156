import { describe, expect, it } from "vitest";
import type { Polling } from "../../api/settings";
import { changeOf, isUsual, loadOf, outOfRange, usualDevice } from "./pollDraft";

const polling: Polling = {
  period_s: 0.1,
  slow_every: 10,
  rare_every: 100,
  load_cap: 0.6,
  devices: [
    {
      description_id: "oat-pmc",
      name: "OAT PMC",
      usual: [{ address: "6041", name: "statusword", rate: "fast", usual: "fast", bits: 243 }],
      items: [
        { address: "6041", name: "statusword", rate: "fast", usual: "fast", bits: 243 },
        { address: "603F", name: "error code", rate: "slow", usual: "rare", bits: 243 },
        { address: "2000", name: "own", rate: "rare", usual: null, bits: 1000 },
      ],
    },
  ],
  buses: [{ turbine: "wtg-07", bus: "can0", bitrate: 500_000, counts: { "oat-pmc": 3, other: 2 }, load: 0 }],
};

describe("the polling list", () => {
  it("takes of the bus what its reads take", () => {
    const [bus] = polling.buses;
    if (!bus) throw new Error("no bus");
    expect(loadOf(polling, bus)).toBeCloseTo((3 * (243 * 10 + 243 * 1 + 1000 * 0.1)) / 500_000, 9);
  });

  it("is sent as addresses with their rates", () => {
    expect(changeOf(polling).devices).toEqual({
      "oat-pmc": { "6041": "fast", "603F": "slow", "2000": "rare" },
    });
  });

  it("names what is out of range", () => {
    expect(outOfRange(polling)).toEqual([]);
    expect(outOfRange({ ...polling, period_s: 0.01, slow_every: 2.5, load_cap: NaN })).toEqual([
      "period_s",
      "slow_every",
      "load_cap",
    ]);
  });

  it("goes back to the usual list", () => {
    const [device] = polling.devices;
    if (!device) throw new Error("no device");
    expect(isUsual(device)).toBe(false);
    expect(isUsual(usualDevice(device))).toBe(true);
  });
});
