/** What was asked for over the socket, until it is answered or the socket is lost. */
import type { components } from "../api/generated";

type Told = components["schemas"]["UrgentTold"];
type Done = components["schemas"]["StopDone"];

/** `taken`: whether the server works on it; `done`: what became of it, null where that is not known. */
export interface Command {
  readonly taken: Promise<boolean>;
  readonly done: Promise<Done | null>;
}

interface Waiting {
  readonly taken: (taken: boolean) => void;
  readonly done: (done: Done | null) => void;
}

export class Asked {
  private number = 0;
  private readonly waiting = new Map<number, Waiting>();

  /** The number to ask under, higher than all before, and what comes of it. */
  ask(): [number, Command] {
    const number = ++this.number;
    let taken: Waiting["taken"] = () => undefined;
    let done: Waiting["done"] = () => undefined;
    const command = {
      taken: new Promise<boolean>((resolve) => (taken = resolve)),
      done: new Promise<Done | null>((resolve) => (done = resolve)),
    };
    this.waiting.set(number, { taken, done });
    return [number, command];
  }

  told({ number, taken, done }: Told): void {
    const waiting = this.waiting.get(number);
    waiting?.taken(taken);
    if (taken && done === null) return;
    waiting?.done(done);
    this.waiting.delete(number);
  }

  /** Nothing is heard any more of what was asked. */
  lost(): void {
    for (const { taken, done } of this.waiting.values()) {
      taken(false);
      done(null);
    }
    this.waiting.clear();
  }
}
