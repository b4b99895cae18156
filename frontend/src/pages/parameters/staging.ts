/** The pending changes of the page, and the hooks by which components see them. */
import { useSyncExternalStore } from "react";
import type { EntryDoc, Raw } from "../../api/types";
import { useShown } from "../../live/live";
import type { Ground } from "../../model/findings";
import type { DeviceContext } from "../../model/shown";
import {
  type Change,
  type Keeper,
  keyOf,
  NOTHING_STAGED,
  StagedStore,
  type StagedState,
} from "../../model/staged";
import type { Lookup } from "../../model/values";
import type { Bench } from "./context";

/** Asked for when it is used, as the code is also read where there is no browser. */
const keeper: Keeper = {
  getItem: (key) => sessionStorage.getItem(key),
  setItem: (key, text) => sessionStorage.setItem(key, text),
};

export const staged = new StagedStore(keeper, () => Date.now());

/** What is pending for the connected turbine; of a recording nothing can be. */
export function useStaged(): StagedState {
  const { recorded } = useShown();
  return useSyncExternalStore(staged.subscribe, () => (recorded ? NOTHING_STAGED : staged.state));
}

export function useChange(device: string, address: string): Change | undefined {
  const { recorded } = useShown();
  return useSyncExternalStore(staged.subscribe, () => (recorded ? undefined : staged.get(device, address)));
}

/** What objects will hold once all that is pending was written. */
export function plannedLookup({ slug, lookup }: DeviceContext): Lookup {
  return (address) => staged.get(slug, address)?.raw ?? lookup(address);
}

export const plannedContext = (context: DeviceContext): DeviceContext => ({
  ...context,
  lookup: plannedLookup(context),
});

export function stage(entry: EntryDoc, raw: Raw, devices: readonly DeviceContext[]): void {
  staged.stage(
    devices.map(({ slug, lookup }) => ({
      device: slug,
      address: entry.address,
      raw,
      from: entry.readable ? lookup(entry.address) : null,
      atMs: Date.now(),
    })),
  );
}

export function unstage(entry: EntryDoc, devices: readonly DeviceContext[]): void {
  staged.drop(devices.map(({ slug }) => keyOf(slug, entry.address)));
}

const known = new WeakMap<object, ReadonlyMap<string, EntryDoc>>();

export function entriesOf(doc: DeviceContext["doc"]): ReadonlyMap<string, EntryDoc> {
  const found = known.get(doc) ?? new Map(doc.entries.map((entry) => [entry.address, entry]));
  known.set(doc, found);
  return found;
}

export const groundOf = ({ doc, lookup }: DeviceContext, role: Bench["role"]): Ground => ({
  doc,
  entries: entriesOf(doc),
  ram: lookup,
  role,
});
