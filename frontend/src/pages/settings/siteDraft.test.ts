import { describe, expect, it } from "vitest";
import type { FoundDevice, SiteTurbine } from "../../api/settings";
import { emptyTurbine, fieldOf, flawsOf, isKnown, takeOver } from "./siteDraft";
import { NO_SLAVE } from "./profibusDraft";

const turbine = (): SiteTurbine => ({
  slug: "wtg-08",
  name: "WTG-08",
  buses: [
    {
      name: "can0",
      connection: "socketcan:can0",
      bitrate: 500_000,
      heartbeat_node: 126,
      ranges: [],
      master: 2,
    },
  ],
  stations: [
    {
      slug: "blade-1",
      name: "blade 1",
      blade: 1,
      devices: [
        {
          slug: "pmm",
          name: "PMM",
          description_id: "oat-pmm",
          bus: "can0",
          node: 1,
          address: "",
          external_stop: "",
          ...NO_SLAVE,
        },
      ],
    },
  ],
});

const found = (node: number, description_id: string | null): FoundDevice => ({
  node,
  description_id,
  device_type: null,
  device_name: null,
  hardware: null,
  software: null,
  vendor: null,
  product: null,
  revision: null,
  serial: null,
  twin: false,
  station: "",
  blade: null,
  device: "",
});

const kinds = (one: SiteTurbine, others: string[] = []) =>
  flawsOf(one, others).map(({ at, key }) => `${at} ${key.replace("page.settings.flaw.", "")}`);

describe("a turbine that is edited", () => {
  it("has nothing against a good one", () => {
    expect(kinds(turbine())).toEqual([]);
  });

  it("names what an empty one lacks", () => {
    expect(kinds(emptyTurbine())).toEqual(["slug empty", "name empty", "bus.can0.connection connection"]);
  });

  it("refuses slugs that are taken or no slugs, and a node that is named twice on a bus", () => {
    const one = turbine();
    one.stations[0]?.devices.push({
      slug: "PMC",
      name: "",
      description_id: "oat-pmc",
      bus: "can1",
      node: 1,
      address: "",
      external_stop: "",
      ...NO_SLAVE,
    });
    expect(kinds(one, ["wtg-08"])).toEqual([
      "slug taken",
      "station.blade-1.device.PMC.slug slug",
      "station.blade-1.device.PMC.name empty",
      "station.blade-1.device.PMC.bus bus",
    ]);
    one.stations[0]?.devices.push({
      slug: "pmc",
      name: "PMC",
      description_id: "oat-pmc",
      bus: "can0",
      node: 1,
      address: "",
      external_stop: "",
      ...NO_SLAVE,
    });
    expect(kinds(one)).toContain("station.blade-1.device.pmc.node node_taken");
  });

  it("finds the field of the server's complaint", () => {
    expect(fieldOf("turbine.wtg-08.bus.can0.connection", "wtg-08")).toBe("bus.can0.connection");
    expect(fieldOf("wtg-08/blade-2/pmc.node", "wtg-08")).toBe("station.blade-2.device.pmc.node");
    expect(fieldOf("schema", "wtg-08")).toBe("schema");
  });

  it("takes found devices over, blades in order, and leaves what is there", () => {
    const taken = takeOver(turbine(), "can0", [
      { found: found(13, "oat-pmc"), station: "blade-3", device: "pmc", description_id: "oat-pmc" },
      { found: found(12, "oat-pmc"), station: "blade-2", device: "pmc", description_id: "oat-pmc" },
      { found: found(7, "oat-pmm"), station: "blade-1", device: "pmm", description_id: "oat-pmm" },
      { found: found(50, null), station: "bench", device: "node-50", description_id: "x.eds" },
    ]);
    expect(taken.stations.map((one) => [one.slug, one.blade, one.devices.map((d) => d.node)])).toEqual([
      ["blade-1", 1, [1]],
      ["blade-2", 2, [12]],
      ["blade-3", 3, [13]],
      ["bench", null, [50]],
    ]);
    expect(isKnown(taken, "can0", 50)).toBe(true);
    expect(isKnown(taken, "can1", 50)).toBe(false);
  });
});
