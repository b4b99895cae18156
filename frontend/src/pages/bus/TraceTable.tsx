import { useVirtualizer } from "@tanstack/react-virtual";
import { type KeyboardEvent, type ReactNode, useEffect, useLayoutEffect, useRef } from "react";
import type { TraceLine } from "../../api/trace";
import { useTexts } from "../../texts/texts";
import classes from "./Bus.module.css";
import { TraceRow } from "./TraceRow";

const ROW_PX = 21;
const OVERSCAN = 6;
const NEAR_PX = 2 * ROW_PX;
const COLUMNS = ["time", "direction", "id", "node", "service", "data", "meaning"];

interface Props {
  rows: readonly TraceLine[];
  /** The newest row stays in sight. */
  following: boolean;
  picked: number | null;
  query: string;
  onPick: (tNs: number | null) => void;
  /** The person has scrolled away from the newest row. */
  onLeave: () => void;
  onOlder: () => void;
  onNewer: (() => void) | null;
  children: ReactNode;
}

/** The rows, of which only those in sight are in the document. Arrows move, Enter picks, Home and End go far. */
export function TraceTable(props: Props) {
  const { rows, following, picked, query, onPick, onLeave, onOlder, onNewer, children } = props;
  const t = useTexts();
  const scroller = useRef<HTMLDivElement>(null);
  const head = useRef<{ first: number | undefined; count: number }>({ first: undefined, count: 0 });
  const ours = useRef(false);
  const virtual = useVirtualizer({
    count: rows.length,
    getScrollElement: () => scroller.current,
    estimateSize: () => ROW_PX,
    overscan: OVERSCAN,
    getItemKey: (index) => rows[index]?.t_ns ?? index,
  });

  // Rows that are put before the first one must not move those that are being read.
  useLayoutEffect(() => {
    const at = scroller.current;
    const before = head.current;
    head.current = { first: rows[0]?.t_ns, count: rows.length };
    if (!at) return;
    if (following) {
      ours.current = true;
      at.scrollTop = at.scrollHeight;
      return;
    }
    if (before.first === undefined || before.first === rows[0]?.t_ns) return;
    const moved = rows.findIndex((row) => row.t_ns === before.first);
    if (moved > 0) at.scrollTop += moved * ROW_PX;
  }, [rows, following]);

  useEffect(() => {
    if (picked === null) return;
    const at = rows.findIndex((row) => row.t_ns === picked);
    if (at >= 0) virtual.scrollToIndex(at, { align: isSeen(virtual, at) ? "auto" : "center" });
    // Only a new choice, or its arrival, moves the table.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [picked, rows.length > 0 && rows.some((row) => row.t_ns === picked)]);

  const onScroll = () => {
    const at = scroller.current;
    if (!at) return;
    if (ours.current) {
      ours.current = false;
      return;
    }
    const below = at.scrollHeight - at.scrollTop - at.clientHeight;
    if (following && below > NEAR_PX) onLeave();
    if (!following && at.scrollTop < NEAR_PX) onOlder();
    if (!following && below < NEAR_PX) onNewer?.();
  };

  const onKeyDown = (event: KeyboardEvent) => {
    const at = rows.findIndex((row) => row.t_ns === picked);
    const to = target(event.key, at, rows.length);
    if (to === null) return;
    event.preventDefault();
    onPick(to < 0 ? null : (rows[to]?.t_ns ?? null));
  };

  return (
    <div
      ref={scroller}
      className={`${classes.trace} bench`}
      role="grid"
      aria-label={t("trace.page.label")}
      aria-rowcount={rows.length + 1}
      tabIndex={0}
      onScroll={onScroll}
      onKeyDown={onKeyDown}
      data-testid="trace"
    >
      <div className={classes.traceHead} role="row" aria-rowindex={1}>
        {COLUMNS.map((column) => (
          <span key={column} role="columnheader" data-column={column}>
            {t(`trace.column.${column}`)}
          </span>
        ))}
      </div>
      <div role="rowgroup" className={classes.lines} style={{ height: virtual.getTotalSize() }}>
        {virtual.getVirtualItems().map((item) => {
          const line = rows[item.index];
          return line ? (
            <TraceRow
              key={item.key}
              line={line}
              top={item.start}
              index={item.index}
              picked={line.t_ns === picked}
              query={query}
              onPick={onPick}
            />
          ) : null;
        })}
      </div>
      {children}
    </div>
  );
}

function isSeen(virtual: { range: { startIndex: number; endIndex: number } | null }, at: number): boolean {
  const range = virtual.range;
  return range !== null && at > range.startIndex && at < range.endIndex;
}

const PAGE = 20;

/** Row that a key goes to; -1 closes, null: the key means nothing here. */
function target(key: string, at: number, count: number): number | null {
  if (count === 0) return null;
  const from = at < 0 ? count - 1 : at;
  const moves: Record<string, number> = {
    ArrowDown: at < 0 ? from : from + 1,
    ArrowUp: at < 0 ? from : from - 1,
    PageDown: from + PAGE,
    PageUp: from - PAGE,
    Home: 0,
    End: count - 1,
  };
  const to = moves[key];
  return to === undefined ? null : Math.max(0, Math.min(count - 1, to));
}
