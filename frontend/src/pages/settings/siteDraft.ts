/** A turbine that is being edited: what is wrong with it, and how found devices are taken over. Pure. */
import type { FoundDevice, SiteDevice, SiteStation, SiteTurbine } from "../../api/settings";

/** What is wrong at one field. `at` names the field as in the site file, below the turbine. */
export interface Flaw {
  at: string;
  key: string;
  details: Record<string, string | number>;
}

const SLUG = /^[a-z0-9]+(-[a-z0-9]+)*$/;
const NODES = { first: 1, last: 127 };
export const DEFAULT_BITRATE = 500_000;
export const NEW_BUS = { connection: "", bitrate: DEFAULT_BITRATE, heartbeat_node: 126 };

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
      if (!Number.isInteger(device.node) || device.node < NODES.first || device.node > NODES.last) {
        return [flaw(at, "node", NODES)];
      }
      const place = `${device.bus} ${device.node}`;
      const other = seen.get(place);
      seen.set(place, `${station.slug}/${device.slug}`);
      return other === undefined ? [] : [flaw(at, "node_taken", { node: device.node, other })];
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
    };
    const at = stations.findIndex((station) => station.slug === one.station);
    const station = stations[at] ?? newStation(one.station);
    if (station.devices.some((known) => known.slug === device.slug)) continue;
    const filled = { ...station, devices: [...station.devices, device] };
    stations = at < 0 ? [...stations, filled] : stations.with(at, filled);
  }
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
