/** A turbine that is being edited: what is wrong with it, and how found devices are taken over. Pure. */
import type { FoundDevice, SiteDevice, SiteStation, SiteTurbine } from "../../api/settings";
import { allows, busOf, isModbus, mostNodes, rangeOf, serverOf } from "./modbusDraft";
import { isAddress, isProfibus, LAST_SLAVE, MASTER, missingOfGsd, NO_SLAVE, portOf } from "./profibusDraft";

/** What is wrong at one field. `at` names the field as in the site file, below the turbine. */
export interface Flaw {
  at: string;
  key: string;
  details: Record<string, string | number>;
}

const SLUG = /^[a-z0-9]+(-[a-z0-9]+)*$/;
export const DEFAULT_BITRATE = 500_000;
export const NEW_BUS = {
  connection: "",
  bitrate: DEFAULT_BITRATE,
  heartbeat_node: 126,
  ranges: [],
  master: MASTER,
};

export const stationAt = (station: SiteStation) => `station.${station.slug}`;
export const deviceAt = (station: SiteStation, device: SiteDevice) =>
  `${stationAt(station)}.device.${device.slug}`;

export function emptyTurbine(): SiteTurbine {
  const bus = { name: "can0", ...NEW_BUS };
  return { slug: "", name: "", buses: [bus], stations: [] };
}

/** Everything that can be said before the server is asked; it has the last word. `others` are taken slugs. */
export function flawsOf(turbine: SiteTurbine, others: readonly string[]): Flaw[] {
  return [
    ...slugFlaws("slug", turbine.slug),
    ...(others.includes(turbine.slug) ? [flaw("slug", "taken", { slug: turbine.slug })] : []),
    ...nameFlaws("name", turbine.name),
    ...(turbine.buses.length === 0 ? [flaw("bus", "no_bus")] : []),
    ...turbine.buses.flatMap((bus) => busFlaws(turbine, bus)),
    ...twice(
      turbine.stations.map((one) => one.slug),
      "station",
    ),
    ...turbine.stations.flatMap((station) => stationFlaws(turbine, station)),
    ...nodeFlaws(turbine),
    ...addressFlaws(turbine),
  ];
}

function flaw(at: string, kind: string, details: Flaw["details"] = {}): Flaw {
  return { at, key: `page.settings.flaw.${kind}`, details };
}

function slugFlaws(at: string, slug: string): Flaw[] {
  if (slug === "") return [flaw(at, "empty")];
  return SLUG.test(slug) ? [] : [flaw(at, "slug")];
}

function nameFlaws(at: string, name: string): Flaw[] {
  return name.trim() === "" ? [flaw(at, "empty")] : [];
}

function busFlaws(turbine: SiteTurbine, bus: SiteTurbine["buses"][number]): Flaw[] {
  const at = `bus.${bus.name}`;
  const same = turbine.buses.filter((one) => one.name === bus.name).length;
  return [
    ...slugFlaws(`${at}.name`, bus.name),
    ...(same > 1 ? [flaw(`${at}.name`, "taken", { slug: bus.name })] : []),
    ...wayFlaws(at, bus),
  ];
}

/** What is wrong with how the bus is reached. */
function wayFlaws(at: string, bus: SiteTurbine["buses"][number]): Flaw[] {
  if (isModbus(bus)) return rangeFlaws(at, bus.ranges);
  return isProfibus(bus) ? portFlaws(at, bus) : adapterFlaws(at, bus);
}

function portFlaws(at: string, bus: SiteTurbine["buses"][number]): Flaw[] {
  return [
    ...(/^[^@,\s]+$/.test(portOf(bus)) ? [] : [flaw(`${at}.connection`, "port")]),
    ...(isAddress(bus.master) ? [] : [flaw(`${at}.master`, "node", { first: 1, last: LAST_SLAVE })]),
  ];
}

/** A slave stands at another address than ours, and its GSD file comes with the names of its modules. */
function slaveFlaws(turbine: SiteTurbine, at: string, device: SiteDevice): Flaw[] {
  const bus = busOf(turbine, device.bus);
  if (bus === undefined || !isProfibus(bus)) return [];
  const missing = missingOfGsd(device);
  return [
    ...(device.node === bus.master ? [flaw(`${at}.node`, "master_taken")] : []),
    ...(missing === null ? [] : [flaw(`${at}.${missing}`, "gsd")]),
  ];
}

function rangeFlaws(at: string, ranges: readonly string[]): Flaw[] {
  if (ranges.length === 0) return [flaw(`${at}.ranges`, "ranges_empty")];
  const wrong = ranges.find((text) => rangeOf(text) === null);
  return wrong === undefined ? [] : [flaw(`${at}.ranges`, "ranges", { range: wrong })];
}

function adapterFlaws(at: string, bus: SiteTurbine["buses"][number]): Flaw[] {
  return [
    ...(/^\w+:.+/.test(bus.connection) ? [] : [flaw(`${at}.connection`, "connection")]),
    ...(Number.isInteger(bus.bitrate) && bus.bitrate >= 0 && bus.bitrate <= 1_000_000
      ? []
      : [flaw(`${at}.bitrate`, "bitrate")]),
  ];
}

function stationFlaws(turbine: SiteTurbine, station: SiteStation): Flaw[] {
  const at = stationAt(station);
  const buses = turbine.buses.map((bus) => bus.name);
  return [
    ...slugFlaws(`${at}.slug`, station.slug),
    ...nameFlaws(`${at}.name`, station.name),
    ...twice(
      station.devices.map((one) => one.slug),
      `${at}.device`,
    ),
    ...station.devices.flatMap((device) => [
      ...slugFlaws(`${deviceAt(station, device)}.slug`, device.slug),
      ...nameFlaws(`${deviceAt(station, device)}.name`, device.name),
      ...(device.description_id === "" ? [flaw(`${deviceAt(station, device)}.description`, "empty")] : []),
      ...(buses.includes(device.bus) ? [] : [flaw(`${deviceAt(station, device)}.bus`, "bus")]),
      ...slaveFlaws(turbine, deviceAt(station, device), device),
    ]),
  ];
}

function twice(slugs: readonly string[], at: string): Flaw[] {
  const again = slugs.filter((slug, place) => slug !== "" && slugs.indexOf(slug) !== place);
  return [...new Set(again)].map((slug) => flaw(`${at}.${slug}.slug`, "taken", { slug }));
}

/** Each node number once on a bus. */
function nodeFlaws(turbine: SiteTurbine): Flaw[] {
  const seen = new Map<string, string>();
  return turbine.stations.flatMap((station) =>
    station.devices.flatMap((device) => {
      const at = `${deviceAt(station, device)}.node`;
      const last = mostNodes(busOf(turbine, device.bus));
      if (!Number.isInteger(device.node) || device.node < 1 || device.node > last) {
        return [flaw(at, "node", { first: 1, last })];
      }
      const place = `${device.bus} ${device.node}`;
      const other = seen.get(place);
      seen.set(place, `${station.slug}/${device.slug}`);
      return other === undefined ? [] : [flaw(at, "node_taken", { node: device.node, other })];
    }),
  );
}

/** Each device of Modbus TCP has an address that its bus allows, and no other has it. */
function addressFlaws(turbine: SiteTurbine): Flaw[] {
  const seen = new Map<string, string>();
  return turbine.stations.flatMap((station) =>
    station.devices.flatMap((device) => {
      const bus = busOf(turbine, device.bus);
      if (bus === undefined || !isModbus(bus)) return [];
      const at = `${deviceAt(station, device)}.address`;
      const server = serverOf(device.address);
      if (server === null) return [flaw(at, "address")];
      if (!allows(bus.ranges, server)) return [flaw(at, "address_outside", { bus: bus.name })];
      const place = `${server.host} ${String(server.port)}`;
      const other = seen.get(place);
      seen.set(place, `${station.slug}/${device.slug}`);
      return other === undefined ? [] : [flaw(at, "address_taken", { other })];
    }),
  );
}

/** The field of a turbine that the server's complaint is about: `turbine.wtg-07.bus.can0.connection`, `wtg-07/a/b.node`. */
export function fieldOf(key: string, slug: string): string {
  const prefix = `turbine.${slug}.`;
  if (key.startsWith(prefix)) return key.slice(prefix.length);
  const path = /^([\w-]+)\/([\w-]+)\/([\w-]+)\.(\w+)$/.exec(key);
  if (path?.[1] === slug) return `station.${path[2] ?? ""}.device.${path[3] ?? ""}.${path[4] ?? ""}`;
  return key;
}

export interface TakenOver {
  found: FoundDevice;
  station: string;
  device: string;
  description_id: string;
}

/** The turbine with found devices at the places that were chosen for them; what stands at such a place stays as it is. */
export function takeOver(turbine: SiteTurbine, bus: string, taken: readonly TakenOver[]): SiteTurbine {
  let stations = turbine.stations;
  for (const one of taken) {
    const device: SiteDevice = {
      slug: one.device,
      name: one.device.toUpperCase(),
      description_id: one.description_id,
      bus,
      node: one.found.node,
      address: "",
      external_stop: "",
      ...NO_SLAVE,
    };
    stations = withDevice({ ...turbine, stations }, one.station, device).stations;
  }
  return { ...turbine, stations };
}

/** The turbine with one more device; nothing happens where one of that name stands at the station. */
export function withDevice(turbine: SiteTurbine, slug: string, device: SiteDevice): SiteTurbine {
  const at = turbine.stations.findIndex((station) => station.slug === slug);
  const station = turbine.stations[at] ?? newStation(slug);
  const there = station.devices.some((known) => known.slug === device.slug);
  const filled = there ? station : { ...station, devices: [...station.devices, device] };
  const stations = at < 0 ? [...turbine.stations, filled] : turbine.stations.with(at, filled);
  return { ...turbine, stations: [...stations].sort(byBlade) };
}

/** A station of this slug; `blade-2` is blade 2. */
export function newStation(slug: string): SiteStation {
  const blade = /^blade-([123])$/.exec(slug);
  return {
    slug,
    name: slug.replaceAll("-", " "),
    blade: blade ? Number(blade[1]) : null,
    devices: [],
  };
}

const byBlade = (a: SiteStation, b: SiteStation) => (a.blade ?? 9) - (b.blade ?? 9);

/** True where the turbine names this node of this bus already. */
export function isKnown(turbine: SiteTurbine, bus: string, node: number): boolean {
  return turbine.stations.some((station) =>
    station.devices.some((device) => device.bus === bus && device.node === node),
  );
}

export function sameTurbine(a: SiteTurbine, b: SiteTurbine): boolean {
  return JSON.stringify(a) === JSON.stringify(b);
}
