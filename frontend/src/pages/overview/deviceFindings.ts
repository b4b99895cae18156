/** What the values of one turbine's devices say that needs a look. Pure: values in, findings out. */
import type { StationRef } from "../../api/types";
import type { Cell } from "../../live/store";
import { type DeviceContext, lineOf, shownOf } from "../../model/shown";
import { differsFromDefault, isUnsaved, rawOf } from "../parameters/cellValue";
import { entriesOf } from "../../ui/reading";
import type { PageSearch } from "../../frame/search";
import { severityOf } from "../../model/axisState";
import { errorCode } from "../../ui/format";
import type { Finding } from "./attention";
import { ERROR_CODE, STATUSWORD } from "./bench";
import {
  BLOC_COUNT,
  BLOCS,
  bitState,
  CHAIN,
  NOMINAL_BLOC_VOLTAGE,
  PMM,
  type Temperature,
  TEMPERATURES,
  temperatureTone,
} from "./layout";

/** Below this state of charge (3080h, %) a battery is named. The manual gives no limit: half of it is gone. */
export const LOW_CHARGE_PCT = 50;
const CHARGE = "3080";

/** One device with all that is known of it. */
export interface Watched {
  station: StationRef;
  context: DeviceContext;
  cells: ReadonlyMap<string, Cell>;
}

export function deviceFindings(devices: readonly Watched[]): Finding[] {
  return [
    ...devices.filter(({ station }) => station.blade === null).flatMap(faultFindings),
    ...devices.flatMap(temperatureFindings),
    ...devices.flatMap(chainFindings),
    ...devices.flatMap(batteryFindings),
    ...devices.flatMap(unsavedFindings),
    ...parityFindings(devices),
    ...defaultFindings(devices),
  ];
}

const rawIn = ({ cells }: Watched, address: string) => rawOf(cells.get(address));

function finding(
  { station, context }: Watched,
  tone: Finding["tone"],
  name: string,
  details: Finding["details"],
  search: Finding["search"],
): Finding {
  const device = context.slug.split("/").at(-1)?.toUpperCase();
  return {
    id: `${name}_${context.slug}_${search?.q ?? ""}`,
    tone,
    key: `page.attention.${name}`,
    details: { blade: station.blade, station: station.name, device, ...details },
    device: context.slug,
    ...(search ? { search } : {}),
  };
}

/** Of a station without a blade; the bench itself tells the faults of blades. */
function faultFindings(watched: Watched): Finding[] {
  const { context } = watched;
  const [code, status] = [rawIn(watched, ERROR_CODE), rawIn(watched, STATUSWORD)];
  if (typeof code !== "number" || code === 0) return [];
  const severity = severityOf(typeof status === "number" ? status : null);
  const known = context.doc.errors.find((one) => one.code === code);
  const details = { code: errorCode(code), text_key_text: known?.text_key ?? "page.card.unknown_code" };
  const name = severity === "error" ? "fault" : "device_warning";
  const found = finding(watched, severity, name, details, { q: ERROR_CODE });
  return [{ ...found, id: `fault_${context.slug}_${code}` }];
}

function shownAt(watched: Watched, address: string): string | null {
  const entry = entriesOf(watched.context.doc).get(address);
  const raw = rawIn(watched, address);
  return entry && raw !== null ? lineOf(shownOf(entry, raw, watched.context)) : null;
}

function temperatureFindings(watched: Watched): Finding[] {
  return TEMPERATURES.filter((spot) => spot.on === watched.context.doc.id).flatMap((spot) => {
    const tone = temperatureTone(rawIn(watched, spot.address), spot, (address) => rawIn(watched, address));
    if (tone === undefined) return [];
    const details = { sensor_key: `page.temperature.${spot.key}`, value: shownAt(watched, spot.address) };
    const name = isLow(watched, spot) ? "temperature_low" : "temperature_high";
    return [finding(watched, tone, name, details, { q: spot.address })];
  });
}

function isLow(watched: Watched, spot: Temperature): boolean {
  const [raw, low] = [rawIn(watched, spot.address), spot.low === null ? null : rawIn(watched, spot.low)];
  return typeof raw === "number" && typeof low === "number" && raw < low;
}

function chainFindings(watched: Watched): Finding[] {
  const { context } = watched;
  return CHAIN.filter((link) => link.on === context.doc.id).flatMap((link) => {
    const state = bitState(context, link.address, link.bit);
    if (state?.set !== false) return [];
    return [finding(watched, "warning", "efc_open", { clamp: state.bit.clamp }, { q: link.address })];
  });
}

function batteryFindings(watched: Watched): Finding[] {
  if (watched.context.doc.id !== PMM) return [];
  const found: Finding[] = [];
  const charge = rawIn(watched, CHARGE);
  if (typeof charge === "number" && charge < LOW_CHARGE_PCT)
    found.push(finding(watched, "warning", "charge_low", { value: shownAt(watched, CHARGE) }, { q: CHARGE }));
  const [count, nominal] = [rawIn(watched, BLOC_COUNT), rawIn(watched, NOMINAL_BLOC_VOLTAGE)];
  if (typeof count !== "number" || typeof nominal !== "number") return found;
  BLOCS.slice(0, count).forEach((address, at) => {
    const volts = rawIn(watched, address);
    if (typeof volts !== "number" || volts >= nominal) return;
    const details = {
      bloc: at + 1,
      value: shownAt(watched, address),
      nominal: shownAt(watched, NOMINAL_BLOC_VOLTAGE),
    };
    found.push(finding(watched, "warning", "bloc_low", details, { q: address }));
  });
  return found;
}

function unsavedFindings(watched: Watched): Finding[] {
  const entries = watched.context.doc.entries.filter((entry) =>
    isUnsaved(entry, watched.cells.get(entry.address)),
  );
  if (entries.length === 0) return [];
  const q = entries.length === 1 ? { q: entries[0]?.address ?? "" } : { only: "unsaved" };
  return [finding(watched, "warning", "unsaved", { count: entries.length }, q)];
}

/** Parameters that may be copied from blade to blade, and are not the same on all of one description. */
export function parityOf(devices: readonly Watched[], id: string): string[] {
  const same = devices.filter((watched) => watched.context.doc.id === id);
  const [first] = same;
  if (!first || same.length < 2) return [];
  return first.context.doc.entries
    .filter((entry) => entry.saved && entry.writable && entry.restore === "copy")
    .map((entry) => entry.address)
    .filter((address) => {
      const raws = same.map((watched) => rawIn(watched, address)).filter((raw) => raw !== null);
      return raws.length > 1 && raws.some((raw) => raw !== raws[0]);
    });
}

function parityFindings(devices: readonly Watched[]): Finding[] {
  const ids = [...new Set(devices.map(({ context }) => context.doc.id))];
  return ids.flatMap((id): Finding[] => {
    const addresses = parityOf(devices, id);
    const first = devices.find(({ context }) => context.doc.id === id);
    if (!first || addresses.length === 0) return [];
    const named = addresses.slice(0, 3).join(", ");
    const details = { name: first.context.doc.name, count: addresses.length, named };
    const q: PageSearch = addresses.length === 1 ? { q: addresses[0] ?? "" } : { only: "different" };
    q.view = "side";
    return [finding(first, "info", addresses.length > 3 ? "parity_many" : "parity", details, q)];
  });
}

function defaultFindings(devices: readonly Watched[]): Finding[] {
  const counts = devices.map((watched) => ({
    watched,
    count: watched.context.doc.entries.filter(
      (entry) =>
        entry.saved &&
        entry.writable &&
        differsFromDefault(entry, watched.cells.get(entry.address), watched.context.node),
    ).length,
  }));
  const total = counts.reduce((sum, one) => sum + one.count, 0);
  const most = counts.toSorted((a, b) => b.count - a.count)[0];
  if (!most || total === 0) return [];
  return [finding(most.watched, "info", "differs", { count: total }, { only: "changed" })];
}
