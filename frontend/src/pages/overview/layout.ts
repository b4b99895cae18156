/** What a blade card shows of each device: by description, object and bit name, as the manual names them. */
import type { BitDoc, Raw } from "../../api/types";
import { fieldOf } from "../../model/bits";
import type { DeviceContext } from "../../model/shown";
import type { Pace } from "../../ui/reading";
import { entriesOf } from "../../ui/reading";

export const PMM = "oat-pmm";
export const PMC = "oat-pmc";

export interface Temperature {
  key: string;
  on: string;
  address: string;
  pace: Pace;
  /** Addresses of its limits, in the same unit. */
  warning: string;
  error: string;
  low: string | null;
}

export const TEMPERATURES: readonly Temperature[] = [
  {
    key: "motor",
    on: PMC,
    address: "6410:09",
    pace: "slow",
    warning: "6410:08",
    error: "6410:07",
    low: null,
  },
  {
    key: "heat_sink_pmc",
    on: PMC,
    address: "6510:03",
    pace: "slow",
    warning: "6510:06",
    error: "6510:02",
    low: null,
  },
  {
    key: "battery",
    on: PMM,
    address: "3010",
    pace: "slow",
    warning: "3110:01",
    error: "3110:02",
    low: "3110:03",
  },
  {
    key: "heat_sink_pmm",
    on: PMM,
    address: "3011",
    pace: "slow",
    warning: "3111:01",
    error: "3111:02",
    low: "3111:03",
  },
  {
    key: "sensor_1",
    on: PMM,
    address: "3012",
    pace: "rare",
    warning: "3112:01",
    error: "3112:02",
    low: "3112:03",
  },
  {
    key: "sensor_2",
    on: PMM,
    address: "3013",
    pace: "rare",
    warning: "3113:01",
    error: "3113:02",
    low: "3113:03",
  },
];

/** Raw values by which a sensor input says that there is no measurement. */
export const SENSOR_SHORT = -32768;
export const SENSOR_OPEN = 32767;

export type Tone = "warning" | "error";

export function temperatureTone(
  raw: Raw | null,
  spot: Temperature,
  limit: (address: string) => Raw | null,
): Tone | undefined {
  if (typeof raw !== "number" || raw === SENSOR_SHORT || raw === SENSOR_OPEN) return undefined;
  const over = (address: string) => {
    const bound = limit(address);
    return typeof bound === "number" && raw >= bound;
  };
  if (over(spot.error)) return "error";
  const least = spot.low === null ? null : limit(spot.low);
  return over(spot.warning) || (typeof least === "number" && raw < least) ? "warning" : undefined;
}

export interface ChainLink {
  key: string;
  on: string;
  address: string;
  bit: string;
}

/**
 * The contacts by which a blade hears and passes on the emergency feather command: 24 V (bit 1) is the healthy state of
 * each. In the order in which a command travels: power module in, its safety chain out, axis out, axis in.
 */
export const CHAIN: readonly ChainLink[] = [
  { key: "efc", on: PMM, address: "30FD", bit: "efc" },
  { key: "efc_direct", on: PMM, address: "30FD", bit: "efc_direct" },
  { key: "safety_chain", on: PMM, address: "30FE:03", bit: "safety_chain" },
  { key: "watchdog", on: PMC, address: "60FE:03", bit: "watchdog" },
  { key: "efc_axis", on: PMC, address: "60FD", bit: "efc" },
];

export interface LimitSwitch {
  shown: string;
  bit: string;
  /** The level at which the axis stands on the switch. */
  reached: 0 | 1;
}

/** Switches at the ends of travel (60FDh): quick-stop inputs open when reached, the feather switch closes. */
export const LIMIT_SWITCHES: readonly LimitSwitch[] = [
  { shown: "0°", bit: "negative_quick_stop", reached: 0 },
  { shown: "90°", bit: "feather_switch", reached: 1 },
  { shown: "95°", bit: "positive_quick_stop", reached: 0 },
];

export interface BitState {
  bit: BitDoc;
  /** null: not known. */
  set: boolean | null;
}

/** A named bit of an object; null where the description has no such bit. */
export function bitState(context: DeviceContext, address: string, name: string): BitState | null {
  const entry = entriesOf(context.doc).get(address);
  if (!entry?.bits) return null;
  const bit = context.doc.bit_tables[entry.bits]?.find((one) => one.name === name);
  if (!bit) return null;
  const raw = context.lookup(address);
  return { bit, set: typeof raw === "number" ? fieldOf(entry, raw, bit) !== 0 : null };
}

export const BLOCS: readonly string[] = [1, 2, 3, 4, 5, 6, 7, 8].map((bloc) => `3061:0${bloc}`);
export const BLOC_COUNT = "3020:04";
export const NOMINAL_BLOC_VOLTAGE = "3020:05";
