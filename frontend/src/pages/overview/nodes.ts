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

/** How long ago the node was heard. Whether that is too long the bench decides: it knows the period to the millisecond. */
export function heartbeatOf(node: NodeData | undefined, nowMs: number): Heartbeat {
  if (node?.heartbeat_t_ns == null) return { heard: Heard.Never, ageMs: null };
  const ageMs = Math.max(0, nowMs - node.heartbeat_t_ns / 1e6);
  return { heard: node.silent ? Heard.Overdue : Heard.Alive, ageMs };
}
