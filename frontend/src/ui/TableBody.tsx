import { defaultRangeExtractor, useVirtualizer } from "@tanstack/react-virtual";
import { type KeyboardEvent, type ReactNode, useRef, useState } from "react";
import type { TableColumn } from "./arrange";
import classes from "./DataTable.module.css";

const ROW_PX = 40;
const DENSE_ROW_PX = 30;
const OVERSCAN = 8;
const PAGE_ROWS = 10;

interface Props<Row> {
  label: string;
  name: string;
  rows: readonly Row[];
  columns: readonly TableColumn<Row>[];
  look: { gridTemplateColumns: string; minWidth: number };
  dense: boolean;
  headPx: number;
  idOf: (row: Row) => string;
  toneOf: ((row: Row) => string) | undefined;
  onOpen: ((row: Row) => void) | undefined;
  onRun: ((row: Row) => void) | undefined;
  selected: string | undefined;
  hold: (part: "pointer" | "focus", inside: boolean) => void;
  head: ReactNode;
  empty: ReactNode;
}

/** Head and rows in one scroller. The row that the keyboard is at is known by its id: it is kept when rows move. */
export function TableBody<Row>(props: Props<Row>) {
  const { rows, columns, idOf, onOpen, onRun, selected, look, name, hold, headPx } = props;
  const rowPx = props.dense ? DENSE_ROW_PX : ROW_PX;
  const scroller = useRef<HTMLDivElement>(null);
  const [at, setAt] = useState<string | null>(null);
  const current = Math.max(
    0,
    rows.findIndex((row) => idOf(row) === at),
  );
  const virtual = useVirtualizer({
    count: rows.length,
    getScrollElement: () => scroller.current,
    estimateSize: () => rowPx,
    overscan: OVERSCAN,
    scrollMargin: headPx,
    scrollPaddingStart: headPx,
    // The row with the focus stays in the document wherever it is scrolled to.
    rangeExtractor: (range) =>
      [...new Set([...defaultRangeExtractor(range), Math.min(current, range.count - 1)])].sort(
        (a, b) => a - b,
      ),
  });
  const go = (to: number) => {
    const index = Math.max(0, Math.min(rows.length - 1, to));
    const row = rows[index];
    if (row === undefined) return;
    setAt(idOf(row));
    virtual.scrollToIndex(index);
    requestAnimationFrame(() =>
      scroller.current?.querySelector<HTMLElement>(`[data-at="${index}"]`)?.focus({ preventScroll: true }),
    );
  };
  const onKey = (event: KeyboardEvent) => {
    const to = target(event.key, current, rows.length);
    const row = rows[current];
    const onRow = event.target instanceof HTMLElement && event.target.role === "row";
    if (to !== undefined) go(to);
    else if (event.key === "Enter" && onRow && row !== undefined)
      (idOf(row) === selected ? (onRun ?? onOpen) : onOpen)?.(row);
    else return;
    event.preventDefault();
  };
  return (
    <div
      ref={scroller}
      role="grid"
      aria-label={props.label}
      aria-rowcount={rows.length + 1}
      className={`${classes.grid} bench`}
      data-testid={`table-${name}`}
    >
      {props.head}
      {rows.length === 0 && <div className={classes.empty}>{props.empty}</div>}
      <div
        role="rowgroup"
        className={classes.lines}
        style={{ height: virtual.getTotalSize(), minWidth: look.minWidth }}
        onKeyDown={onKey}
        onPointerEnter={() => hold("pointer", true)}
        onPointerLeave={() => hold("pointer", false)}
        onFocus={() => hold("focus", true)}
        onBlur={() => hold("focus", false)}
      >
        {virtual.getVirtualItems().map(({ index, start }) => {
          const row = rows[index];
          if (row === undefined) return null;
          const id = idOf(row);
          return (
            <div
              key={id}
              role="row"
              aria-rowindex={index + 2}
              aria-selected={onOpen ? id === selected : undefined}
              data-at={index}
              data-open={onOpen !== undefined}
              data-tone={props.toneOf?.(row)}
              data-testid={`${name}-${id}`}
              tabIndex={index === current ? 0 : -1}
              className={classes.row}
              style={{
                gridTemplateColumns: look.gridTemplateColumns,
                transform: `translateY(${start - headPx}px)`,
                height: rowPx,
              }}
              onFocus={() => setAt(id)}
              onClick={() => {
                setAt(id);
                onOpen?.(row);
              }}
              onDoubleClick={onRun && (() => onRun(row))}
            >
              {columns.map((column) => (
                <div
                  key={column.id}
                  role="gridcell"
                  data-column={column.id}
                  data-numeric={column.numeric}
                  title={column.text(row)}
                >
                  {column.cell ? column.cell(row) : column.text(row)}
                </div>
              ))}
            </div>
          );
        })}
      </div>
    </div>
  );
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
