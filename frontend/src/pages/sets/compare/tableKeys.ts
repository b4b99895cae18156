/** The keyboard in a comparison: arrows move, fold and unfold; Enter shows the details, Space picks. */
import { type KeyboardEvent, type RefObject, useCallback, useState } from "react";
import type { RowActions } from "./CompareRow";
import type { CompareLine } from "./lines";

const PAGE_ROWS = 12;

interface Options {
  lines: readonly CompareLine[];
  scroller: RefObject<HTMLDivElement | null>;
  scrollTo: (index: number) => void;
  actions: RowActions;
  pickable: boolean;
}

export function useCompareKeys({ lines, scroller, scrollTo, actions, pickable }: Options) {
  const [active, setActive] = useState(0);
  const at = Math.min(active, Math.max(0, lines.length - 1));
  const go = useCallback((index: number) => setActive(index), []);
  const onKeyDown = (event: KeyboardEvent) => {
    // What is typed into a button inside the table is its own.
    if (event.target !== scroller.current || event.ctrlKey || event.altKey || event.metaKey) return;
    const line = lines[at];
    const to = target(event.key, at, lines.length);
    if (to !== undefined) {
      const next = Math.max(0, Math.min(lines.length - 1, to));
      setActive(next);
      scrollTo(next);
    } else if (!line || !act(event.key, line, actions, pickable)) return;
    event.preventDefault();
  };
  return { at, go, onKeyDown };
}

function act(key: string, line: CompareLine, actions: RowActions, pickable: boolean): boolean {
  const open = key === "ArrowRight" ? true : key === "ArrowLeft" ? false : undefined;
  if (line.kind === "section") {
    if (open === undefined && key !== "Enter" && key !== " ") return false;
    actions.onFold(line.id, open ?? !line.open);
    return true;
  }
  if (line.kind !== "row") return false;
  if (key === " " && pickable) actions.onPick(line.id);
  else if (open !== undefined || key === "Enter") actions.onExpand(line.id, open ?? !line.expanded);
  else return false;
  return true;
}

function target(key: string, at: number, count: number): number | undefined {
  const moves: Record<string, number> = {
    ArrowDown: at + 1,
    ArrowUp: at - 1,
    PageDown: at + PAGE_ROWS,
    PageUp: at - PAGE_ROWS,
    Home: 0,
    End: count - 1,
  };
  return moves[key];
}
