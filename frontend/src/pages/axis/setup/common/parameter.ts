/** An object that a picture sets up: what RAM holds, what is pending for it, and whether it may be changed. */
import { useQuery } from "@tanstack/react-query";
import { useContext, useMemo } from "react";
import type { RuleFinding } from "../../../../api/rules";
import { sessionQuery } from "../../../../api/queries";
import type { EntryDoc } from "../../../../api/types";
import { useDeviceVersion, useShown } from "../../../../live/live";
import { toNumber } from "../../../../model/decimal";
import { type Lock, lockOf } from "../../../../model/locks";
import { type DeviceContext, lineOf, shownOf } from "../../../../model/shown";
import { type Change, keyOf, type StagedState } from "../../../../model/staged";
import { limitsOf, quantityOf } from "../../../../model/values";
import { JudgedContext, type Judged } from "../../../parameters/rules";
import { entriesOf, stage, useStaged } from "../../../parameters/staging";
import { type Bounds, within } from "./bounds";

export interface Parameter {
  context: DeviceContext;
  entry: EntryDoc;
  /** What RAM holds; null where it is not known. */
  ram: number | null;
  /** What it will hold once all that is pending was written. */
  raw: number | null;
  change: Change | undefined;
  lock: Lock | null;
  /** Rules that it breaks, with all that is pending. */
  findings: readonly RuleFinding[];
}

export interface Setup {
  /** null where the device, or the object in it, is not there. */
  of: (context: DeviceContext | null, address: string) => Parameter | null;
  recorded: boolean;
}

/** Looks again with every value that comes and every change that is staged. */
export function useSetup(pmm: DeviceContext | null, pmc: DeviceContext | null): Setup {
  const { recorded } = useShown();
  const role = useQuery(sessionQuery).data?.role ?? "viewer";
  const { changes } = useStaged();
  const judged = useContext(JudgedContext);
  const versions = `${useDeviceVersion(pmm?.slug ?? "")} ${useDeviceVersion(pmc?.slug ?? "")}`;
  return useMemo(
    () => ({
      of: (context, address) => find(context, address, { changes, judged, role, recorded }),
      recorded,
    }),
    // eslint-disable-next-line react-hooks/exhaustive-deps -- a new version is a new look at the same store
    [changes, judged, role, recorded, versions],
  );
}

interface Ground {
  changes: StagedState["changes"];
  judged: Judged;
  role: Parameters<typeof lockOf>[1];
  recorded: boolean;
}

function find(context: DeviceContext | null, address: string, ground: Ground): Parameter | null {
  const entry = context && entriesOf(context.doc).get(address);
  if (!context || !entry) return null;
  const key = keyOf(context.slug, address);
  const change = ground.changes.get(key);
  const ram = numberOf(context.lookup(address));
  return {
    context,
    entry,
    ram,
    raw: change ? numberOf(change.raw) : ram,
    change,
    lock: lockOf(entry, ground.role, ground.recorded),
    findings: ground.judged.marks.get(key) ?? [],
  };
}

const numberOf = (raw: unknown): number | null => (typeof raw === "number" ? raw : null);

/** Makes it pending; back to what RAM holds it is pending no more. */
export function setRaw({ entry, context, raw: before }: Parameter, raw: number): void {
  if (raw !== before) stage(entry, raw, [context]);
}

/** In the unit that is shown, as a number: for pictures, not for text. */
export function scaled({ entry, context }: Parameter, raw: number): number {
  return raw * factorOf(entry, context);
}

export const factorOf = (entry: EntryDoc, { lookup }: DeviceContext): number =>
  toNumber(quantityOf(entry, lookup).scale);

export function textOf({ entry, context }: Parameter, raw: number | null): string {
  return raw === null ? "–" : lineOf(shownOf(entry, raw, context));
}

/** What the description itself allows now, and what the picture does. */
export function boundsOf(
  { entry, context }: Parameter,
  own: Bounds,
  look: (address: string) => number | null,
): Bounds {
  const { low, high } = limitsOf(entry, (address) => look(address) ?? context.lookup(address));
  return within(
    {
      low: low === null ? null : { raw: Math.ceil(low), other: null },
      high: high === null ? null : { raw: Math.floor(high), other: null },
    },
    own,
  );
}
