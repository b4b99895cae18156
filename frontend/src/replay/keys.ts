/** The keys of a replay. Where something is typed, chosen or moved by keys of its own they keep out. */
import { useEffect, useEffectEvent } from "react";
import type { LiveStore } from "../live/store";
import { speedBeside, type Transport } from "./transport";

/** Keys by what they do, as the help lists them. */
export const KEYS = [
  { name: "play", keys: ["Space"] },
  { name: "time", keys: ["←", "→"] },
  { name: "fine", keys: ["Shift ←", "Shift →"] },
  { name: "frame", keys: [",", "."] },
  { name: "event", keys: ["p", "n"] },
  { name: "speed", keys: ["−", "+"] },
  { name: "loop_ends", keys: ["[", "]"] },
  { name: "loop", keys: ["l"] },
  { name: "ends", keys: ["Home", "End"] },
  { name: "mark", keys: ["m"] },
  { name: "help", keys: ["?"] },
] as const;

const STEP_S = 1;
const FINE_S = 0.1;
/** Keys pressed here are not for the replay. */
export const TYPING =
  "input, textarea, select, [contenteditable], [role=dialog], [role=menu], [role=listbox]";
/** These take arrows, Home and End for themselves; buttons and links take the space bar. */
const MOVES =
  "[role=grid], [role=treegrid], [role=slider], [role=tablist], [role=radiogroup], [role=row], [role=tree]";
const PRESSED = "button, a, summary, [role=button], [role=row]";

interface Actions {
  store: LiveStore;
  transport: Transport;
  onLoopEnd: (end: "from" | "to") => void;
  onLoop: () => void;
  onHelp: () => void;
}

export function useReplayKeys({ store, transport, onLoopEnd, onLoop, onHelp }: Actions): void {
  const hear = useEffectEvent((event: KeyboardEvent) => {
    const { target, key } = event;
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
    if (!(target instanceof Element) || target.closest(TYPING)) return;
    const { cursor } = store;
    if (!cursor) return;
    const held = event.shiftKey ? FINE_S : STEP_S;
    const plain: Record<string, () => void> = {
      ",": () => transport.step("frame", false),
      ".": () => transport.step("frame", true),
      p: () => transport.step("event", false),
      n: () => transport.step("event", true),
      "-": () => transport.setSpeed(speedBeside(cursor.speed, false)),
      "+": () => transport.setSpeed(speedBeside(cursor.speed, true)),
      "[": () => onLoopEnd("from"),
      "]": () => onLoopEnd("to"),
      l: onLoop,
      "?": onHelp,
    };
    const moving: Record<string, () => void> = {
      ArrowLeft: () => transport.stepTime(-held),
      ArrowRight: () => transport.stepTime(held),
      Home: () => transport.seek(cursor.from_ns),
      End: () => transport.seek(cursor.to_ns),
    };
    const pressing: Record<string, () => void> = { " ": () => transport.toggle(cursor) };
    const action =
      plain[key] ??
      (target.closest(MOVES) ? undefined : moving[key]) ??
      (target.closest(PRESSED) ? undefined : pressing[key]);
    if (!action) return;
    event.preventDefault();
    action();
  });
  useEffect(() => {
    const listener = (event: KeyboardEvent) => hear(event);
    window.addEventListener("keydown", listener);
    return () => window.removeEventListener("keydown", listener);
  }, []);
}
