/** What the server's rules say of the stations: of what is pending, and of what is being typed. */
import { useDebouncedValue } from "@mantine/hooks";
import { useQuery } from "@tanstack/react-query";
import { createContext, useContext, useMemo } from "react";
import { checkQuery, type RuleFinding, rulesQuery, type StationFindings } from "../../api/rules";
import type { EntryDoc, Raw } from "../../api/types";
import type { DeviceContext } from "../../model/shown";
import { about, byPlace, pendingOf, stationOf } from "../../model/ruleFindings";
import { keyOf } from "../../model/staged";
import { useStaged } from "./staging";

const TYPING_MS = 150;

export interface Judged {
  stations: readonly StationFindings[];
  /** Broken rules by device and address. */
  marks: ReadonlyMap<string, readonly RuleFinding[]>;
  error: Error | null;
}

const NOTHING: Judged = { stations: [], marks: new Map(), error: null };

export const JudgedContext = createContext<Judged>(NOTHING);

/** All stations of the connected turbine, with all that is pending. */
export function useJudged(connected: boolean): Judged {
  const { changes } = useStaged();
  const pending = useMemo(() => pendingOf(changes.values()), [changes]);
  const [asked] = useDebouncedValue(pending, TYPING_MS);
  const { data, error } = useQuery(checkQuery(null, asked, connected));
  return useMemo(() => ({ stations: data ?? [], marks: byPlace(data ?? []), error }), [data, error]);
}

/** Titles of the rules that an object's value breaks, for the mark in its cell. */
export function useMarks(device: string, address: string): readonly RuleFinding[] {
  return useContext(JudgedContext).marks.get(keyOf(device, address)) ?? NONE;
}

const NONE: readonly RuleFinding[] = [];

/** What the rules say of one object, with the value that is being typed; null while nothing valid is. */
export function useFindingsOf(entry: EntryDoc, device: DeviceContext, typed: Raw | null): RuleFinding[] {
  const { changes } = useStaged();
  const { slug, doc } = device;
  const pending = useMemo(
    () =>
      pendingOf(
        changes.values(),
        typed === null ? undefined : { device: slug, address: entry.address, raw: typed },
      ),
    [changes, typed, slug, entry.address],
  );
  const [asked] = useDebouncedValue(pending, TYPING_MS);
  const rules = useQuery(rulesQuery).data;
  const stations = useQuery(checkQuery(stationOf(slug), asked, true)).data;
  return useMemo(() => {
    const findings = stations?.find((one) => one.devices.includes(slug))?.findings ?? [];
    return about(findings, rules ?? [], slug, doc.id, entry.address);
  }, [stations, rules, slug, doc.id, entry.address]);
}
