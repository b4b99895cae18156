import { useHearing, useLink, useNodes, useServerNow } from "../../live/live";
import { Heard, heartbeatOf } from "../overview/nodes";

const CHECK_MS = 500;

/** True while nothing can be heard of the device: the page is deaf, the bus is gone, or its heartbeat is overdue. */
export function useSilent(slug: string): boolean {
  const hearing = useHearing().state === "hearing";
  const connected = useLink()?.state === "connected";
  const nowMs = useServerNow(CHECK_MS);
  const { heard } = heartbeatOf(useNodes().get(slug), nowMs);
  return !hearing || !connected || heard === Heard.Overdue;
}
