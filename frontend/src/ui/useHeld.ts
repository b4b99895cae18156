/** The rows of a live table stand still while somebody is among them: nothing moves away under the pointer. */
import { useState } from "react";
import { inHeldOrder } from "./arrange";

interface Held {
  ids: readonly string[];
  /** The filter and order that it was held under: others make it void. */
  under: string;
  pointer: boolean;
  focus: boolean;
}

const FREE: Held = { ids: [], under: "", pointer: false, focus: false };

export function useHeld<Row>(
  rows: readonly Row[],
  idOf: (row: Row) => string,
  under: string,
  live: boolean,
): { rows: readonly Row[]; hold: (part: "pointer" | "focus", inside: boolean) => void } {
  const [held, setHeld] = useState(FREE);
  const holds = (now: Held) => live && now.under === under && (now.pointer || now.focus);
  const hold = (part: "pointer" | "focus", inside: boolean) => {
    if (!live) return;
    setHeld((now) => ({ ...now, ids: holds(now) ? now.ids : rows.map(idOf), under, [part]: inside }));
  };
  return { rows: holds(held) ? inHeldOrder(rows, idOf, held.ids) : rows, hold };
}
