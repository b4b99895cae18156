import type { NodeData } from "../../api/types";

export enum Heard {
  /** Never heard since the page looks. */
  Never = "never",
  Alive = "alive",
  Overdue = "overdue",
}

/** Consumer time of a heartbeat is commonly one and a half to two producer times; two leaves room for a busy bus. */
const OVERDUE_PERIODS = 2;
/** Where no period is known, as with the axes of a node without heartbeat. */
const UNKNOWN_PERIOD_MS = 1000;

export interface Heartbeat {
  heard: Heard;
  ageMs: number | null;
}

export function heartbeatOf(node: NodeData | undefined, nowMs: number): Heartbeat {
  if (node?.heartbeat_t_ns == null) return { heard: Heard.Never, ageMs: null };
  const ageMs = Math.max(0, nowMs - node.heartbeat_t_ns / 1e6);
  const limitMs = OVERDUE_PERIODS * (node.heartbeat_period_ms || UNKNOWN_PERIOD_MS);
  return { heard: ageMs > limitMs ? Heard.Overdue : Heard.Alive, ageMs };
}
