/** Words for what PDOs carry and when they go. */
import type { PdoFinding, PdoMapped, PdoSetup } from "../../../api/pdo";
import type { DeviceContext } from "../../../model/shown";
import { titleOf } from "../../../model/rows";
import type { Translate } from "../../../texts/texts";
import { entriesOf } from "../../../ui/reading";
import { isDummy } from "./edits";

/** Name of a mapped object; its address where the description has none. */
export function objectName(context: DeviceContext | null, mapped: PdoMapped, t: Translate): string {
  if (isDummy(mapped)) return t("page.pdo.filler", { bits: mapped.bits });
  const entry = context === null ? undefined : entriesOf(context.doc).get(mapped.object);
  return entry === undefined ? mapped.object : titleOf(entry, t);
}

const LAST_SYNC = 240;
const NAMES: Readonly<Record<number, string>> = {
  252: "remote_sync",
  253: "remote",
  254: "event_maker",
  255: "event_profile",
};

/** When a PDO goes, or is taken, in words. */
export function typeText(direction: "rpdo" | "tpdo", type: number, t: Translate): string {
  const receives = direction === "rpdo";
  if (type <= LAST_SYNC) {
    if (receives) return t("page.pdo.type.rpdo_sync", { type });
    if (type === 0) return t("page.pdo.type.sync_change");
    return type === 1 ? t("page.pdo.type.sync") : t("page.pdo.type.sync_nth", { type });
  }
  const name = NAMES[type];
  if (name === undefined) return t("page.pdo.type.other", { type });
  return receives && type > 253 ? t(`page.pdo.type.rpdo_${name}`) : t(`page.pdo.type.${name}`);
}

/** Inhibit time in ms: the device counts 100 µs. */
export const inhibitMs = (setup: PdoSetup) => setup.inhibit_100us / 10;

export const findingText = (finding: PdoFinding, t: Translate) =>
  t(`page.pdo.finding.${finding.code}`, finding.details);

export function share(value: number, t: Translate): string {
  return value.toLocaleString(t.language, { style: "percent", maximumFractionDigits: 1 });
}

export const rateText = (perSecond: number, t: Translate) =>
  t("page.pdo.per_second", { rate: perSecond.toLocaleString(t.language, { maximumFractionDigits: 1 }) });
