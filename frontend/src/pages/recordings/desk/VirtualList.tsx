import { useVirtualizer } from "@tanstack/react-virtual";
import { type KeyboardEvent, type ReactNode, useEffect, useRef, useState } from "react";
import classes from "./Desk.module.css";

const OVERSCAN = 10;
const PAGE_ROWS = 12;

interface Props<Row> {
  label: string;
  rows: readonly Row[];
  rowPx: number;
  idOf: (row: Row) => string;
  /** Attributes and content of a row. */
  row: (row: Row) => {
    props: React.HTMLAttributes<HTMLDivElement> & Record<`data-${string}`, unknown>;
    cells: ReactNode;
  };
  onKey?: (event: KeyboardEvent, row: Row) => boolean;
  onPick: (row: Row) => void;
  /** This one is kept in view as it changes, unless somebody is at work in the list. */
  follow?: number | undefined;
  role?: "list" | "tree";
  testId: string;
}

/** Many rows, of which those in view are drawn; arrows go from one to the next, Enter picks. */
export function VirtualList<Row>(props: Props<Row>) {
  const { label, rows, rowPx, idOf, row, onKey, onPick, follow, role = "list", testId } = props;
  const scroller = useRef<HTMLDivElement>(null);
  const [at, setAt] = useState(0);
  const [held, setHeld] = useState(false);
  const current = Math.min(at, rows.length - 1);
  const virtual = useVirtualizer({
    count: rows.length,
    getScrollElement: () => scroller.current,
    estimateSize: () => rowPx,
    overscan: OVERSCAN,
  });
  useEffect(() => {
    if (follow !== undefined && follow >= 0 && !held) virtual.scrollToIndex(follow, { align: "center" });
    // eslint-disable-next-line react-hooks/exhaustive-deps -- the list moves with what it follows alone
  }, [follow, held]);
  const go = (to: number) => {
    const index = Math.max(0, Math.min(rows.length - 1, to));
    setAt(index);
    virtual.scrollToIndex(index);
    requestAnimationFrame(() =>
      scroller.current?.querySelector<HTMLElement>(`[data-index="${index}"]`)?.focus({ preventScroll: true }),
    );
  };
  const onKeyDown = (event: KeyboardEvent) => {
    const own = rows[current];
    if (own === undefined || event.ctrlKey || event.metaKey || event.altKey) return;
    const moves: Record<string, number> = {
      ArrowDown: current + 1,
      ArrowUp: current - 1,
      PageDown: current + PAGE_ROWS,
      PageUp: current - PAGE_ROWS,
      Home: 0,
      End: rows.length - 1,
    };
    const to = moves[event.key];
    if (to !== undefined) go(to);
    else if (event.target instanceof HTMLElement && event.target.dataset.index === undefined) return;
    else if (onKey?.(event, own) === true) go(current);
    else if (event.key === "Enter") onPick(own);
    else return;
    event.preventDefault();
    event.stopPropagation();
  };
  return (
    <div
      ref={scroller}
      className={`${classes.list} bench`}
      role={role}
      aria-label={label}
      onKeyDown={onKeyDown}
      onPointerEnter={() => setHeld(true)}
      onPointerLeave={() => setHeld(false)}
      onFocus={() => setHeld(true)}
      onBlur={() => setHeld(false)}
      data-testid={testId}
    >
      <div role="presentation" style={{ position: "relative", height: virtual.getTotalSize() }}>
        {virtual.getVirtualItems().map(({ index, start }) => {
          const own = rows[index];
          if (own === undefined) return null;
          const { props: attributes, cells } = row(own);
          return (
            <div
              key={idOf(own)}
              role={role === "tree" ? "treeitem" : "listitem"}
              aria-setsize={rows.length}
              aria-posinset={index + 1}
              tabIndex={index === current ? 0 : -1}
              data-index={index}
              {...attributes}
              className={`${classes.item} ${attributes.className ?? ""}`}
              style={{ height: rowPx, transform: `translateY(${start}px)` }}
              onFocus={() => setAt(index)}
              onClick={() => {
                setAt(index);
                onPick(own);
              }}
            >
              {cells}
            </div>
          );
        })}
      </div>
    </div>
  );
}
