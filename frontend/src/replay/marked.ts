/** What people marked in the recording that is replayed: incidents and annotations, on one list by time. */
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { annotationsQuery, type Incident, incidentsQuery, type Severity } from "../api/incidents";

export interface Marked {
  id: string;
  kind: "incident" | "annotation";
  fromNs: number;
  toNs: number;
  /** The moment it is about. */
  atNs: number;
  text: string;
  author: string;
  severity: Severity;
  /** To open it; null of an annotation. */
  incident: Incident | null;
}

const NOTHING: readonly Marked[] = [];

/** Empty while it is not known. An annotation that belongs to an incident stands beside it. */
export function useMarked(recording: string): readonly Marked[] {
  const incidents = useQuery(incidentsQuery).data;
  const annotations = useQuery(annotationsQuery(recording)).data?.annotations;
  return useMemo(() => {
    const ofIncidents = (incidents ?? [])
      .filter((one) => one.recording === recording)
      .map((one): Marked => ({
        id: one.id,
        kind: "incident",
        fromNs: one.from_ns,
        toNs: one.to_ns,
        atNs: one.at_ns,
        text: one.title,
        author: one.author,
        severity: "error",
        incident: one,
      }));
    const others = (annotations ?? []).map((one): Marked => ({
      id: one.id,
      kind: "annotation",
      fromNs: one.from_ns,
      toNs: one.to_ns,
      atNs: one.from_ns,
      text: one.text,
      author: one.person,
      severity: one.severity,
      incident: null,
    }));
    const all = [...ofIncidents, ...others].toSorted((a, b) => a.atNs - b.atNs);
    return all.length === 0 ? NOTHING : all;
  }, [incidents, annotations, recording]);
}
