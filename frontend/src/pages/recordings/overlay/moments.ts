/** Moments of a recording that have a name: what was marked and noted, and where its cursor stands. */
import { useQuery } from "@tanstack/react-query";
import { annotationsQuery, type Incident } from "../../../api/incidents";
import { replayedQuery } from "../../../api/overlay";
import { useTexts } from "../../../texts/texts";
import { timeOfDay } from "../../../ui/format";

export interface Moment {
  tNs: number;
  label: string;
}

export function useMoments(file: string, name: string, incidents: readonly Incident[]): Moment[] {
  const t = useTexts();
  const notes = useQuery(annotationsQuery(file)).data?.annotations ?? [];
  const cursor = useQuery(replayedQuery(name)).data?.cursor;
  const label = (kind: string, tNs: number, text: string) =>
    t(`page.overlay.zero.${kind}`, { time: timeOfDay(tNs / 1e6), text });
  return [
    ...incidents
      .filter((one) => one.replay === name)
      .map(({ at_ns, title }) => ({ tNs: at_ns, label: label("incident", at_ns, title) })),
    ...notes.map(({ from_ns, text }) => ({ tNs: from_ns, label: label("note", from_ns, text) })),
    ...(cursor ? [{ tNs: cursor.t_ns, label: label("cursor", cursor.t_ns, "") }] : []),
  ];
}
