import { describe, expect, it } from "vitest";
import type { SiteTurbine } from "../../api/settings";
import {
  allows,
  asModbus,
  deviceAtServer,
  freeNode,
  freeSlug,
  isModbus,
  rangeOf,
  serverOf,
  serverText,
} from "./modbusDraft";
import { flawsOf, NEW_BUS } from "./siteDraft";
import { NO_SLAVE } from "./profibusDraft";

const bench = (): SiteTurbine => ({
  slug: "bench",
  name: "Bench",
  buses: [
    { ...asModbus({ name: "can0", ...NEW_BUS }), ranges: ["192.168.2.0/29", "10.0.0.5-10.0.0.7:1502"] },
  ],
  stations: [
    {
      slug: "bench",
      name: "bench",
      blade: null,
      devices: [
        {
          slug: "drive",
          name: "Drive",
          description_id: "nanotec-pd4e",
          bus: "lan",
          node: 1,
          address: "192.168.2.1",
          external_stop: "",
          ...NO_SLAVE,
        },
      ],
    },
  ],
});

const at = (turbine: SiteTurbine) =>
  flawsOf(turbine, []).map((one) => `${one.at} ${one.key.split(".").at(-1) ?? ""}`);

const withDevice = (change: Partial<SiteTurbine["stations"][number]["devices"][number]>): SiteTurbine => {
  const turbine = bench();
  const device = turbine.stations[0]?.devices[0];
  if (device) Object.assign(device, change);
  return turbine;
};

describe("addresses of Modbus TCP", () => {
  it("are read and written as the site file has them", () => {
    expect(serverOf("192.168.2.20")).toEqual({ host: "192.168.2.20", port: 502, unit: 0 });
    expect(serverOf("[fe80::1]:1502/7")).toEqual({ host: "fe80::1", port: 1502, unit: 7 });
    for (const text of ["", "a b", "1.2.3.4:0", "1.2.3.4:70000", "1.2.3.4/256", "fe80::1"])
      expect(serverOf(text), text).toBeNull();
    for (const text of ["192.168.2.20", "192.168.2.20:1502/3", "[fe80::1]/2"])
      expect(serverText(serverOf(text) ?? { host: "", port: 0, unit: 0 })).toBe(text);
  });

  it("are allowed by ranges, networks and single addresses, and by their port", () => {
    const ranges = ["192.168.2.0/29", "10.0.0.5-10.0.0.7:1502", "10.0.0.9"];
    const fits = (text: string) => {
      const server = serverOf(text);
      return server !== null && allows(ranges, server);
    };
    for (const text of ["192.168.2.1", "192.168.2.6/3", "10.0.0.6:1502", "10.0.0.9"])
      expect(fits(text), text).toBe(true);
    for (const text of [
      "192.168.2.0",
      "192.168.2.7",
      "192.168.2.1:1502",
      "10.0.0.8:1502",
      "10.0.0.6",
      "drive",
    ])
      expect(fits(text), text).toBe(false);
  });

  it("leave IPv6 to the server", () => {
    expect(rangeOf("[fe80::]/64")).toBeNull();
    expect(rangeOf("[fe80::1]:502")).toBe("open");
    expect(allows(["[fe80::1]"], { host: "fe80::1", port: 502, unit: 0 })).toBe(true);
    expect(allows(["[fe80::1]"], { host: "1.2.3.4", port: 502, unit: 0 })).toBe(false);
  });

  it("refuse what is no range", () => {
    for (const text of ["", "everybody", "1.2.3.4-1.2.3.3", "1.2.3.0/33", "1.2.3", "01.2.3.4", "1.2.3.4:0"])
      expect(rangeOf(text), text).toBeNull();
  });
});

describe("a turbine on Modbus TCP", () => {
  it("has nothing against a good one", () => {
    expect(isModbus(bench().buses[0])).toBe(true);
    expect(at(bench())).toEqual([]);
  });

  it("names what is wrong with its bus and its devices", () => {
    const empty = bench();
    empty.buses = empty.buses.map((bus) => ({ ...bus, ranges: [] }));
    expect(at(empty)).toEqual([
      "bus.lan.ranges ranges_empty",
      "station.bench.device.drive.address address_outside",
    ]);
    const wrong = bench();
    wrong.buses = wrong.buses.map((bus) => ({ ...bus, ranges: [...bus.ranges, "nobody"] }));
    expect(at(wrong)).toEqual(["bus.lan.ranges ranges"]);
    expect(at(withDevice({ address: "" }))).toEqual(["station.bench.device.drive.address address"]);
    expect(at(withDevice({ address: "192.168.2.9" }))).toEqual([
      "station.bench.device.drive.address address_outside",
    ]);
    expect(at(withDevice({ node: 247 }))).toEqual([]);
    expect(at(withDevice({ node: 248 }))).toEqual(["station.bench.device.drive.node node"]);
  });

  it("has one device at an address", () => {
    const turbine = bench();
    turbine.stations = turbine.stations.map((station) => ({
      ...station,
      devices: station.devices.flatMap((one) => [
        one,
        { ...one, slug: "drive-2", node: 2, address: "192.168.2.1/5" },
      ]),
    }));
    expect(at(turbine)).toEqual(["station.bench.device.drive-2.address address_taken"]);
    expect(deviceAtServer(turbine, { host: "192.168.2.1", port: 502, unit: 9 })).toBe("bench/drive");
    expect(deviceAtServer(turbine, { host: "192.168.2.1", port: 503, unit: 0 })).toBeUndefined();
    expect(freeNode(turbine, "lan")).toBe(3);
    expect(freeSlug(turbine.stations[0])).toBe("drive-3");
    expect(freeSlug(undefined)).toBe("drive");
  });
});
