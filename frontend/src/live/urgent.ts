/**
 * STOP and FEATHER: over the socket, which is open already. A browser has six connections to a server; where each waits for
 * the end of something long, a request would wait as well. Where the socket does not take it at once, a request goes too.
 */
import { commands } from "../api/client";
import type { StopResult } from "../api/types";
import type { Command } from "./asked";
import type { Urgent } from "./socket";

/** The server says within a few milliseconds that it has taken it. */
export const TAKEN_MS = 100;

type Ask = (urgent: Urgent) => Command | null;

function byRequest({ command, device }: Urgent): Promise<StopResult> {
  if (device !== undefined) return commands.stopOne(device);
  return command === "stop" ? commands.stop() : commands.feather();
}

/** By whichever way is answered first. Rejects as the request does. */
export async function commandBy(
  ask: Ask,
  urgent: Urgent,
  request: (urgent: Urgent) => Promise<StopResult> = byRequest,
): Promise<StopResult> {
  const asked = ask(urgent);
  if (asked === null) return request(urgent);
  const late = new Promise<boolean>((resolve) => setTimeout(() => resolve(false), TAKEN_MS));
  if (await Promise.race([asked.taken, late])) return (await asked.done) ?? request(urgent);
  const answered = asked.done.then((done) => done ?? Promise.reject(new Error("not over the socket")));
  const requested = request(urgent);
  return Promise.any([answered, requested]).catch(() => requested);
}
