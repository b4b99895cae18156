import { describe, expect, it } from "vitest";
import type { SiteTurbine } from "../../api/settings";
import { mostNodes } from "./modbusDraft";
import { asProfibus, kindOf, MASTER, NO_SLAVE } from "./profibusDraft";
import { emptyTurbine, flawsOf, NEW_BUS, takeOver } from "./siteDraft";

const line = { ...asProfibus({ name: "can0", ...NEW_BUS }), connection: "profibus:/dev/ttyUSB0" };

function turbine(node: number, slave: Partial<typeof NO_SLAVE> = {}): SiteTurbine {
  const device = {
    slug: "cylinders",
    name: "CYLINDERS",
    description_id: "wandfluh-ed2",
    bus: line.name,
    node,
    address: "",
    external_stop: "",
    ...NO_SLAVE,
    ...slave,
  };
  const station = { slug: "bench", name: "bench", blade: null, devices: [device] };
  return { slug: "bench-ed2", name: "BENCH", buses: [line], stations: [station] };
}

const keysOf = (one: SiteTurbine) =>
  flawsOf(one, []).map(({ at, key }) => `${at} ${key.split(".").at(-1) ?? ""}`);

describe("a PROFIBUS line", () => {
  it("has a port, a bit rate and our own address, and nothing of CAN", () => {
    expect(line).toMatchObject({ name: "dp0", bitrate: 500_000, master: MASTER, ranges: [] });
    expect([kindOf(line), mostNodes(line)]).toEqual(["profibus-dp", 126]);
    expect(kindOf(emptyTurbine().buses[0])).toBe("canopen");
    expect(flawsOf(turbine(6), [])).toEqual([]);
  });

  it("needs a port without a rate in it", () => {
    for (const connection of ["profibus:", "profibus:/dev/ttyUSB0@500000"]) {
      const one = { ...turbine(6), buses: [{ ...line, connection }] };
      expect(keysOf(one)).toEqual(["bus.dp0.connection port"]);
    }
  });

  it("has each slave at another address than ours", () => {
    expect(keysOf(turbine(MASTER))).toEqual(["station.bench.device.cylinders.node master_taken"]);
    expect(keysOf(turbine(127))).toEqual(["station.bench.device.cylinders.node node"]);
  });

  it("takes a GSD file only with the names of its modules", () => {
    expect(keysOf(turbine(6, { gsd: "a.gsd" }))).toEqual(["station.bench.device.cylinders.modules gsd"]);
    expect(keysOf(turbine(6, { modules: ["Telegram 1"] }))).toEqual([
      "station.bench.device.cylinders.gsd gsd",
    ]);
    expect(keysOf(turbine(6, { gsd: "a.gsd", modules: ["Telegram 1"] }))).toEqual([]);
  });

  it("keeps what is said of a slave where another one is taken over", () => {
    const kept = turbine(6, { telegram: 102, pzd_order: "high-high" });
    const found = { node: 7 } as Parameters<typeof takeOver>[2][number]["found"];
    const after = takeOver(kept, "dp0", [
      { found, station: "bench", device: "second", description_id: "wandfluh-ed2" },
    ]);
    expect(after.stations[0]?.devices).toMatchObject([
      { slug: "cylinders", telegram: 102, pzd_order: "high-high" },
      { slug: "second", node: 7, telegram: null, pzd_order: "" },
    ]);
  });
});
