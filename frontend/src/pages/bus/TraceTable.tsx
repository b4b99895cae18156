import { type KeyboardEvent, type ReactNode, useEffect, useLayoutEffect, useRef, useState } from "react";
import type { TraceLine } from "../../api/trace";
import { useTexts } from "../../texts/texts";
import classes from "./Bus.module.css";
import { TraceRow } from "./TraceRow";

const ROW_PX = 21;
const HEAD_PX = 26;
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

/** The rows, of which only those in sight are in the document. Arrows move, Home and End go far. */
export function TraceTable(props: Props) {
  const { rows, following, picked, query, onPick, onLeave, onOlder, onNewer, children } = props;
  const t = useTexts();
  const scroller = useRef<HTMLDivElement>(null);
  const [top, setTop] = useState(0);
  const height = useHeight(scroller);
  const before = useRef<{ first: number | undefined; top: number; total: number }>({
    first: undefined,
    top: 0,
    total: 0,
  });
  const inSight = Math.ceil(height / ROW_PX);
  // The newest rows are drawn at once, without waiting for the scroll that shows them.
  const from = Math.max(0, (following ? rows.length - inSight : Math.floor(top / ROW_PX)) - OVERSCAN);
  const to = Math.min(rows.length, from + inSight + 2 * OVERSCAN);

  useLayoutEffect(() => {
    const at = scroller.current;
    if (!at) return;
    const { first } = before.current;
    if (following) {
      at.scrollTop = at.scrollHeight;
    } else if (first !== undefined && first !== rows[0]?.t_ns) {
      // Rows that are put before the first one must not move those that are being read.
      const moved = rows.findIndex((row) => row.t_ns === first);
      if (moved > 0) at.scrollTop += moved * ROW_PX;
    }
    before.current = { first: rows[0]?.t_ns, top: at.scrollTop, total: at.scrollHeight };
  }, [rows, following]);

  const index = picked === null ? -1 : rows.findIndex((row) => row.t_ns === picked);
  const known = index >= 0;
  useEffect(() => {
    const at = scroller.current;
    if (!at || !known) return;
    reveal(at, index);
    // Only another choice, or its arrival, moves the table.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [picked, known]);

  const onScroll = () => {
    const at = scroller.current;
    if (!at) return;
    setTop(at.scrollTop);
    const below = at.scrollHeight - at.scrollTop - at.clientHeight;
    if (following) {
      // Ours only go down: up goes a person.
      const { top: was, total } = before.current;
      if (at.scrollTop < was - NEAR_PX && at.scrollHeight >= total && below > NEAR_PX) onLeave();
      return;
    }
    if (at.scrollTop < NEAR_PX) onOlder();
    if (below < NEAR_PX) onNewer?.();
  };

  const onKeyDown = (event: KeyboardEvent) => {
    const next = target(event.key, index, rows.length);
    if (next === null) return;
    event.preventDefault();
    onPick(rows[next]?.t_ns ?? null);
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
      <div role="rowgroup" className={classes.lines} style={{ height: rows.length * ROW_PX }}>
        {rows.slice(from, to).map((line, at) => (
          <TraceRow
            key={line.t_ns}
            line={line}
            top={(from + at) * ROW_PX}
            index={from + at}
            picked={line.t_ns === picked}
            query={query}
            onPick={onPick}
          />
        ))}
      </div>
      {children}
    </div>
  );
}

/** Height of what is in sight, px. */
function useHeight(of: React.RefObject<HTMLDivElement | null>): number {
  const [height, setHeight] = useState(ROW_PX);
  useLayoutEffect(() => {
    const at = of.current;
    if (!at) return;
    const observer = new ResizeObserver(() => setHeight(at.clientHeight));
    observer.observe(at);
    return () => observer.disconnect();
  }, [of]);
  return height;
}

/** Bring a row into sight: to the middle where it was far, else as little as needed. */
function reveal(at: HTMLDivElement, index: number): void {
  const y = index * ROW_PX;
  const room = at.clientHeight - HEAD_PX;
  if (y >= at.scrollTop && y + ROW_PX <= at.scrollTop + room) return;
  const near = y > at.scrollTop - room / 2 && y < at.scrollTop + 1.5 * room;
  if (!near) at.scrollTop = y - room / 2;
  else at.scrollTop = y < at.scrollTop ? y : y + ROW_PX - room;
}

const PAGE = 20;

/** Row that a key goes to; null: the key means nothing here. */
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
