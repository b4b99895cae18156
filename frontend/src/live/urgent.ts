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

const byRequest: Send = ({ command, device }, press) => {
  if (device !== undefined) return commands.stopOne(device, press);
  return command === "stop" ? commands.stop(press) : commands.feather(press);
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
