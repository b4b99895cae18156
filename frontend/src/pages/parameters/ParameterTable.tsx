import { IconArrowDown, IconArrowUp, IconChevronDown, IconChevronRight } from "@tabler/icons-react";
import { type SortingState, useTable } from "@tanstack/react-table";
import { useVirtualizer } from "@tanstack/react-virtual";
import { type KeyboardEvent, useEffect, useMemo, useRef, useState } from "react";
import { useServerNow } from "../../live/live";
import { type GroupLine, type Line, linesOf, type ParameterRow } from "../../model/rows";
import { useTexts } from "../../texts/texts";
import { TableCell } from "./Cells";
import { Column, columnsOf, features, WIDTHS } from "./columns";
import { useDevice } from "./context";
import classes from "./Parameters.module.css";

const ROW_PX = 40;
const OVERSCAN = 8;
const PAGE_ROWS = 12;
const AGE_MS = 1000;

interface Props {
  rows: readonly ParameterRow[];
  /** The device is not heard: every value is stale. */
  silent: boolean;
  sorting: SortingState;
  hidden: readonly string[];
  closed: ReadonlySet<string>;
  onSort: (sorting: SortingState) => void;
  onToggleGroup: (id: string, open?: boolean) => void;
  onOpen: (address: string) => void;
  /** Lines in the order shown, for copy and export. */
  onLines: (rows: ParameterRow[], columns: Column[]) => void;
}

export function ParameterTable(props: Props) {
  const context = useDevice();
  const t = useTexts();
  const columns = useMemo(() => columnsOf(context), [context]);
  const shown = useMemo(
    () => Object.values(Column).filter((column) => !props.hidden.includes(column)),
    [props.hidden],
  );
  const visibility = useMemo(() => Object.fromEntries(props.hidden.map((id) => [id, false])), [props.hidden]);
  const table = useTable({
    features,
    columns,
    data: props.rows,
    getRowId: (row: ParameterRow) => row.entry.address,
    enableMultiSort: false,
    state: { sorting: props.sorting, columnVisibility: visibility },
    onSortingChange: (change) => props.onSort(typeof change === "function" ? change(props.sorting) : change),
  });
  const sorted = table.getRowModel().rows;
  const groups = useMemo(() => context.doc.groups.map((group) => group.id), [context.doc]);
  const lines = useMemo(
    () =>
      linesOf(
        sorted.map((row) => row.original),
        groups,
        props.closed,
      ),
    [sorted, groups, props.closed],
  );
  const { onLines } = props;
  useEffect(() => {
    onLines(
      sorted.map((row) => row.original),
      shown,
    );
  }, [onLines, sorted, shown]);

  const tracks = shown.map((id) => WIDTHS[id]).join(" ");
  return (
    <Lines {...props} lines={lines} shown={shown} tracks={tracks}>
      <div className={classes.head} role="row" aria-rowindex={1} style={{ gridTemplateColumns: tracks }}>
        {table.getVisibleLeafColumns().map((column) => {
          const direction = column.getIsSorted();
          const Arrow = direction === "desc" ? IconArrowDown : IconArrowUp;
          return (
            <div
              key={column.id}
              role="columnheader"
              aria-sort={direction === false ? "none" : direction === "asc" ? "ascending" : "descending"}
            >
              <button type="button" onClick={() => column.toggleSorting()} data-testid={`sort-${column.id}`}>
                {t(`page.table.column.${column.id}`)}
                {direction !== false && <Arrow size={14} aria-hidden />}
              </button>
            </div>
          );
        })}
      </div>
    </Lines>
  );
}

interface LinesProps extends Props {
  lines: readonly Line[];
  shown: readonly Column[];
  tracks: string;
  children: React.ReactNode;
}

/** The virtual body: only what is seen is in the document. Arrow keys move, Enter opens, left and right fold groups. */
function Lines({ lines, shown, tracks, children, silent, onOpen, onToggleGroup }: LinesProps) {
  const t = useTexts();
  const nowMs = useServerNow(AGE_MS);
  const scroller = useRef<HTMLDivElement>(null);
  const [active, setActive] = useState(0);
  const virtual = useVirtualizer({
    count: lines.length,
    getScrollElement: () => scroller.current,
    estimateSize: () => ROW_PX,
    overscan: OVERSCAN,
    getItemKey: (index) => keyOf(lines[index], index),
    scrollPaddingStart: ROW_PX,
  });
  const at = Math.min(active, Math.max(0, lines.length - 1));
  const go = (to: number) => {
    const next = Math.max(0, Math.min(lines.length - 1, to));
    setActive(next);
    virtual.scrollToIndex(next);
  };
  const onKeyDown = (event: KeyboardEvent) => {
    if (
      event.target !== scroller.current ||
      !act(event.key, lines[at], at, go, lines.length, onOpen, onToggleGroup)
    )
      return;
    event.preventDefault();
  };
  return (
    <div
      ref={scroller}
      className={`${classes.grid} bench`}
      role="treegrid"
      tabIndex={0}
      aria-label={t("page.table.label")}
      aria-rowcount={lines.length + 1}
      aria-activedescendant={lines[at] ? `line-${keyOf(lines[at], at)}` : undefined}
      data-testid="parameters"
      onKeyDown={onKeyDown}
    >
      {children}
      <div role="rowgroup" className={classes.lines} style={{ height: virtual.getTotalSize() }}>
        {virtual.getVirtualItems().map((item) => {
          const line = lines[item.index];
          if (!line) return null;
          const common = {
            id: `line-${String(item.key)}`,
            role: "row",
            "aria-rowindex": item.index + 2,
            "data-active": item.index === at,
            style: { transform: `translateY(${item.start}px)`, gridTemplateColumns: tracks },
          };
          return line.kind === "group" ? (
            <Group key={item.key} line={line} common={common} onToggle={onToggleGroup} />
          ) : (
            <div
              key={item.key}
              className={classes.row}
              aria-level={2}
              {...common}
              onClick={() => setActive(item.index)}
            >
              {shown.map((column) => (
                <div key={column} role="gridcell" data-column={column}>
                  <TableCell column={column} row={line.row} nowMs={nowMs} silent={silent} onOpen={onOpen} />
                </div>
              ))}
            </div>
          );
        })}
      </div>
      {lines.length === 0 && <p className={classes.empty}>{t("page.table.none_match")}</p>}
    </div>
  );
}

function keyOf(line: Line | undefined, index: number): string {
  if (!line) return String(index);
  return line.kind === "group" ? `group-${line.id}` : line.row.entry.address;
}

interface GroupProps {
  line: GroupLine;
  common: React.HTMLAttributes<HTMLDivElement>;
  onToggle: (id: string) => void;
}

function Group({ line, common, onToggle }: GroupProps) {
  const Chevron = line.open ? IconChevronDown : IconChevronRight;
  return (
    <div {...common} className={classes.group} aria-level={1} aria-expanded={line.open}>
      <div role="gridcell">
        <button
          type="button"
          tabIndex={-1}
          onClick={() => onToggle(line.id)}
          data-testid={`group-${line.id}`}
        >
          <Chevron size={17} aria-hidden />
          {line.title}
          <span className="dim">{line.count}</span>
        </button>
      </div>
    </div>
  );
}

/** What a key does on the active line; false where it means nothing here. */
function act(
  key: string,
  line: Line | undefined,
  at: number,
  go: (to: number) => void,
  count: number,
  onOpen: (address: string) => void,
  onToggle: (id: string, open?: boolean) => void,
): boolean {
  const moves: Record<string, number> = {
    ArrowDown: at + 1,
    ArrowUp: at - 1,
    PageDown: at + PAGE_ROWS,
    PageUp: at - PAGE_ROWS,
    Home: 0,
    End: count - 1,
  };
  const to = moves[key];
  if (to !== undefined) {
    go(to);
    return true;
  }
  if (!line) return false;
  const group = line.kind === "group" ? line.id : line.row.group;
  if (key === "Enter" || key === " ") {
    if (line.kind === "entry") onOpen(line.row.entry.address);
    else onToggle(group);
    return true;
  }
  if (key === "ArrowLeft" || key === "ArrowRight") {
    onToggle(group, key === "ArrowRight");
    return true;
  }
  return false;
}
