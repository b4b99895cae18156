/** PROFIBUS-DP lines in a turbine that is edited: their port, and what is known of a slave. Pure. */
import type { Site, SiteBus, SiteDevice } from "../../api/settings";

/** How the connection of such a line begins; the serial port follows. */
export const PROFIBUS = "profibus:";
/** Bit rates that slaves find by themselves. */
export const LINE_RATES = [
  9600, 19_200, 45_450, 93_750, 187_500, 500_000, 1_500_000, 3_000_000, 6_000_000, 12_000_000,
];
export const TELEGRAMS = [1, 2, 100, 101, 102, 103];
export const ORDERS = ["high-high", "high-low", "low-high", "low-low"];
export const LAST_SLAVE = 126;
/** Our own address where nothing else is said. */
export const MASTER = 2;
const LINE_RATE = 500_000;
const OWN_NODE = 126;

export type BusKind = Site["descriptions"][number]["bus"];
type SlaveKey = "telegram" | "pzd_order" | "gsd" | "modules";

/** What a device has that says nothing of itself as a slave. */
export const NO_SLAVE: Required<Pick<SiteDevice, SlaveKey>> = {
  telegram: null,
  pzd_order: "",
  gsd: "",
  modules: [],
};

export const isProfibus = (bus: Pick<SiteBus, "connection"> | undefined): boolean =>
  bus?.connection.startsWith(PROFIBUS) === true;

export function kindOf(bus: Pick<SiteBus, "connection"> | undefined): BusKind {
  if (bus?.connection === "modbus-tcp") return "modbus-tcp";
  return isProfibus(bus) ? "profibus-dp" : "canopen";
}

/** The bus as a line whose port is still to be named; what only a bus of another kind has is gone. */
export function asProfibus(bus: SiteBus): SiteBus {
  const name = /^(can\d|lan)$/.test(bus.name) ? "dp0" : bus.name;
  const rest = { heartbeat_node: OWN_NODE, ranges: [], master: MASTER };
  return { name, connection: PROFIBUS, bitrate: LINE_RATE, ...rest };
}

export const portOf = (bus: Pick<SiteBus, "connection">): string => bus.connection.slice(PROFIBUS.length);

/** Whether this can be the address of a slave, or our own. */
export const isAddress = (node: number): boolean => Number.isInteger(node) && node >= 1 && node <= LAST_SLAVE;

/** A GSD file and the names of its modules go together: what is missing; null where nothing is. */
export function missingOfGsd({
  gsd,
  modules,
}: Pick<SiteDevice, "gsd" | "modules">): "gsd" | "modules" | null {
  if ((gsd.trim() === "") === (modules.length === 0)) return null;
  return modules.length === 0 ? "modules" : "gsd";
}
