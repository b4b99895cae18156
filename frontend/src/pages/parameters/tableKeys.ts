/** The keyboard in the table: arrows move, Enter edits, "i" shows the details, Space stars, groups fold. */
import { type KeyboardEvent, type RefObject, useCallback, useState } from "react";
import type { Line } from "../../model/rows";

const PAGE_ROWS = 12;

interface Options {
  lines: readonly Line[];
  /** The devices of the value columns. */
  slugs: readonly string[];
  scroller: RefObject<HTMLDivElement | null>;
  scrollTo: (index: number) => void;
  onEdit: (address: string, slug: string) => void;
  onOpen: (address: string, slug: string) => void;
  onStar: (address: string) => void;
  onToggleGroup: (id: string, open?: boolean) => void;
}

export function useTableKeys(options: Options) {
  const { lines, slugs, scroller } = options;
  const [active, setActive] = useState(0);
  const [column, setColumn] = useState(0);
  const at = Math.min(active, Math.max(0, lines.length - 1));
  const slug = slugs[Math.min(column, slugs.length - 1)] ?? "";
  const go = useCallback((index: number) => setActive(index), []);

  const move = (to: number) => {
    const next = Math.max(0, Math.min(lines.length - 1, to));
    setActive(next);
    options.scrollTo(next);
  };
  const onKeyDown = (event: KeyboardEvent) => {
    // What is typed into a field or a button inside the table is theirs.
    if (event.target !== scroller.current || event.ctrlKey || event.altKey || event.metaKey) return;
    const line = lines[at];
    const to = target(event.key, at, lines.length);
    if (to !== undefined) move(to);
    else if (!line || !act(event.key, line)) return;
    event.preventDefault();
  };
  const act = (key: string, line: Line): boolean =>
    line.kind === "group"
      ? actOnGroup(key, line.id, line.open)
      : actOnEntry(key, line.row.entry.address, line.row.group);

  const actOnGroup = (key: string, id: string, open: boolean): boolean => {
    if (key === "Enter" || key === " ") options.onToggleGroup(id, !open);
    else if (key === "ArrowLeft" || key === "ArrowRight") options.onToggleGroup(id, key === "ArrowRight");
    else return false;
    return true;
  };
  const actOnEntry = (key: string, address: string, group: string): boolean => {
    if (key === "Enter") options.onEdit(address, slug);
    else if (key === "i") options.onOpen(address, slug);
    else if (key === " ") options.onStar(address);
    else if (key === "ArrowRight") setColumn(Math.min(slugs.length - 1, column + 1));
    else if (key === "ArrowLeft" && column > 0) setColumn(column - 1);
    else if (key === "ArrowLeft") options.onToggleGroup(group, false);
    else return false;
    return true;
  };
  return { at, slug, go, onKeyDown };
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
