/** Buses of Modbus TCP in a turbine that is edited: which addresses they allow, and which device stands where. Pure. */
import type { SiteBus, SiteStation, SiteTurbine } from "../../api/settings";
import { isProfibus, LAST_SLAVE, MASTER } from "./profibusDraft";

/** The connection of a bus whose devices have an address each. */
export const MODBUS = "modbus-tcp";
export const PORT = 502;
const MOST = { can: 127, modbus: 247 };
const OWN_NODE = 126;
/** A gap in the address of a device is no device: the server reads names too, but no range holds one. */
const SERVER = /^(\[[\dA-Fa-f:.]+\]|[\w.-]+)(?::(\d{1,5}))?(?:\/(\d{1,3}))?$/;
const RANGE = /^(\[[^\]]+\]|[^:[\]]+)(?::(\d{1,5}))?$/;

export interface Server {
  host: string;
  port: number;
  unit: number;
}

export const isModbus = (bus: Pick<SiteBus, "connection"> | undefined): boolean => bus?.connection === MODBUS;

export const busOf = (turbine: SiteTurbine, name: string): SiteBus | undefined =>
  turbine.buses.find((bus) => bus.name === name);

/** The highest number that a device of the bus may have. */
export function mostNodes(bus: SiteBus | undefined): number {
  if (isProfibus(bus)) return LAST_SLAVE;
  return isModbus(bus) ? MOST.modbus : MOST.can;
}

/** The bus as one of Modbus TCP: it has ranges instead of an adapter, a bit rate and a node of ours. */
export function asModbus(bus: SiteBus): SiteBus {
  const name = /^can\d$/.test(bus.name) ? "lan" : bus.name;
  return { name, connection: MODBUS, bitrate: 0, heartbeat_node: OWN_NODE, ranges: [], master: MASTER };
}

/** `HOST[:PORT][/UNIT]`, or null where it is none. */
export function serverOf(text: string): Server | null {
  const match = SERVER.exec(text.trim());
  if (match?.[1] === undefined) return null;
  const port = Number(match[2] ?? PORT);
  const unit = Number(match[3] ?? 0);
  return port > 0 && port < 65_536 && unit < 256
    ? { host: match[1].replaceAll(/[[\]]/g, ""), port, unit }
    : null;
}

/** As the site file has it, what is usual left out. */
export function serverText({ host, port, unit }: Server): string {
  const name = host.includes(":") ? `[${host}]` : host;
  return `${name}${port === PORT ? "" : `:${String(port)}`}${unit === 0 ? "" : `/${String(unit)}`}`;
}

interface Range {
  first: number;
  last: number;
  port: number;
}

/** `IP`, `IP-IP` or `NETWORK/BITS`, each with or without a port. IPv6 is left to the server: "open". */
export function rangeOf(text: string): Range | "open" | null {
  const match = RANGE.exec(text.trim());
  const port = Number(match?.[2] ?? PORT);
  if (match?.[1] === undefined || !(port > 0 && port < 65_536)) return null;
  if (match[1].startsWith("[")) return "open";
  const [hosts = "", bits] = match[1].split("/");
  if (bits !== undefined) return network(hosts, bits, port);
  const [from = "", to = from] = hosts.split("-");
  const first = ipv4(from);
  const last = ipv4(to);
  return first === null || last === null || first > last ? null : { first, last, port };
}

function network(host: string, bits: string, port: number): Range | null {
  const at = ipv4(host);
  if (at === null || !/^\d{1,2}$/.test(bits) || Number(bits) > 32) return null;
  const size = 2 ** (32 - Number(bits));
  const first = Math.floor(at / size) * size;
  const some = size > 2 ? 1 : 0; // neither the network itself nor its broadcast address is a device
  return { first: first + some, last: first + size - 1 - some, port };
}

function ipv4(text: string): number | null {
  const parts = text.trim().split(".");
  if (parts.length !== 4 || !parts.every((part) => /^(0|[1-9]\d{0,2})$/.test(part) && Number(part) < 256))
    return null;
  return parts.reduce((sum, part) => sum * 256 + Number(part), 0);
}

/** Whether one of the ranges holds the address, as far as that can be said here. */
export function allows(ranges: readonly string[], server: Server): boolean {
  const host = ipv4(server.host);
  return ranges.some((text) => {
    const range = rangeOf(text);
    if (range === null || range === "open") return range === "open" && host === null;
    return host !== null && range.first <= host && host <= range.last && range.port === server.port;
  });
}

/** Which device of the turbine listens at this place already. */
export function deviceAtServer(turbine: SiteTurbine, server: Server): string | undefined {
  for (const station of turbine.stations)
    for (const device of station.devices) {
      const other = serverOf(device.address);
      if (device.address !== "" && other?.host === server.host && other.port === server.port)
        return `${station.slug}/${device.slug}`;
    }
  return undefined;
}

/** The lowest number that no device of the bus has. */
export function freeNode(turbine: SiteTurbine, bus: string): number {
  const taken = new Set(
    turbine.stations.flatMap((one) =>
      one.devices.filter((each) => each.bus === bus).map((each) => each.node),
    ),
  );
  let node = 1;
  while (taken.has(node)) node += 1;
  return node;
}

/** An identifier that no device of the station has: drive, drive-2 … */
export function freeSlug(station: Pick<SiteStation, "devices"> | undefined): string {
  const taken = station?.devices.map((one) => one.slug) ?? [];
  let slug = "drive";
  for (let number = 2; taken.includes(slug); number += 1) slug = `drive-${String(number)}`;
  return slug;
}
