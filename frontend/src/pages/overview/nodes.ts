import type { NodeData } from "../../api/types";

export enum Heard {
  /** Never heard since the bench looks. */
  Never = "never",
  Alive = "alive",
  Overdue = "overdue",
}

export interface Heartbeat {
  heard: Heard;
  ageMs: number | null;
}

/** A device without heartbeats is read all the time: no answer for so long is none. */
const ANSWER_LATE_MS = 5000;

/**
 * How long ago the node was heard: its heartbeat, or on a bus that has none its latest answer. Whether a heartbeat is too
 * old the bench decides: it knows the period to the millisecond.
 */
export function heartbeatOf(node: NodeData | undefined, nowMs: number): Heartbeat {
  const heardNs = node?.managed === false ? node.answered_t_ns : node?.heartbeat_t_ns;
  if (node === undefined || heardNs == null) return { heard: Heard.Never, ageMs: null };
  const ageMs = Math.max(0, nowMs - heardNs / 1e6);
  const overdue = node.managed ? node.silent : ageMs > ANSWER_LATE_MS;
  return { heard: overdue ? Heard.Overdue : Heard.Alive, ageMs };
}
