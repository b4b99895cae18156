/**
 * STOP and FEATHER: over the socket, which is open already. A browser has six connections to a server; where each waits for
 * the end of something long, a request would wait as well. Where the socket does not take it at once, a request goes too; both
 * bear the same number, so that the later of them never undoes what was commanded since.
 */
import { commands } from "../api/client";
import type { StopResult } from "../api/types";
import type { Command } from "./asked";
import type { Press, Urgent } from "./socket";

/** The server says within a few milliseconds that it has taken it. */
export const TAKEN_MS = 100;

type Ask = (urgent: Urgent) => { press: Press; command: Command | null };
type Send = (urgent: Urgent, press: Press) => Promise<StopResult>;

/** A request that has no answer for so long is taken back: nobody expects what it commands any more. */
export const GIVE_UP_MS = 5000;

/** Rejects as requests do, with Unreachable where nothing is answered. */
export const byRequest: Send = async ({ command, device }, press) => {
  const giving = new AbortController();
  const timer = setTimeout(() => giving.abort(), GIVE_UP_MS);
  try {
    if (device !== undefined) return await commands.stopOne(device, press, giving.signal);
    return await (command === "stop" ? commands.stop : commands.feather)(press, giving.signal);
  } finally {
    clearTimeout(timer);
  }
};

/** By whichever way is answered first; the server does it once. Rejects as the request does. */
export async function commandBy(ask: Ask, urgent: Urgent, send: Send = byRequest): Promise<StopResult> {
  const { press, command } = ask(urgent);
  const request = () => send(urgent, press);
  if (command === null) return request();
  const late = new Promise<boolean>((resolve) => setTimeout(() => resolve(false), TAKEN_MS));
  if (await Promise.race([command.taken, late])) return (await command.done) ?? request();
  const answered = command.done.then((done) => done ?? Promise.reject(new Error("not over the socket")));
  const requested = request();
  return Promise.any([answered, requested]).catch(() => requested);
}
