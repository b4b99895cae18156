import { IconArrowDown, IconArrowUp } from "@tabler/icons-react";
import { memo, type RefObject, useEffect, useImperativeHandle, useMemo, useRef, useState } from "react";
import { useVirtualizer } from "@tanstack/react-virtual";
import { useServerNow } from "../../live/live";
import { lockOf } from "../../model/locks";
import { type GroupTally, type Line, linesOf, type ParameterRow } from "../../model/rows";
import { useTexts } from "../../texts/texts";
import { type ColumnSpec, Column, nextSorting, type Sorting } from "./columns";
import { useBenchOfTable } from "./context";
import { isInline } from "./draft";
import { EntryRow, GroupRow } from "./Lines";
import classes from "./Parameters.module.css";
import { useTableKeys } from "./tableKeys";

const ROW_PX = 40;
const OVERSCAN = 4;
/** Rows in the document are used again for other lines: more than are ever seen at a time. */
const SLOTS = 64;
const AGE_MS = 1000;

/** What others may ask of the table. */
export interface TableHandle {
  jumpTo: (group: string) => void;
  focus: () => void;
}

interface Props {
  /** In the order in which they are to be shown. */
  rows: readonly ParameterRow[];
  columns: readonly ColumnSpec[];
  tally: GroupTally;
  /** Devices that are not heard: every value of theirs is stale. */
  silent: ReadonlySet<string>;
  sorting: Sorting | null;
  closed: ReadonlySet<string>;
  /** Address of the parameter whose details are open. */
  opened: string | undefined;
  handle: RefObject<TableHandle | null>;
  onSort: (sort: string | undefined) => void;
  onToggleGroup: (id: string, open?: boolean) => void;
  onOpen: (address: string, slug: string) => void;
}

export interface Editing {
  address: string;
  slug: string;
}

/** The virtual table: only what is seen is in the document. */
export const ParameterTable = memo(function ParameterTable(props: Props) {
  const { rows, columns, closed, silent, onOpen, onToggleGroup } = props;
  const t = useTexts();
  const bench = useBenchOfTable();
  const nowMs = useServerNow(AGE_MS);
  const scroller = useRef<HTMLDivElement>(null);
  const [editing, setEditing] = useState<Editing | null>(null);
  const groups = useMemo(() => bench.devices[0]?.doc.groups.map((group) => group.id) ?? [], [bench.devices]);
  const lines = useMemo(() => linesOf(rows, groups, closed), [rows, groups, closed]);
  const virtual = useVirtualizer({
    count: lines.length,
    getScrollElement: () => scroller.current,
    estimateSize: () => ROW_PX,
    overscan: OVERSCAN,
    scrollPaddingStart: ROW_PX,
    useFlushSync: false,
  });
  const done = () => {
    setEditing(null);
    scroller.current?.focus();
  };
  const edit = useEdit(bench, lines, onOpen, setEditing);
  const keys = useTableKeys({
    lines,
    slugs: bench.devices.map((one) => one.slug),
    scroller,
    scrollTo: (index) => virtual.scrollToIndex(index),
    onEdit: edit,
    onOpen,
    onStar: bench.toggleStar,
    onToggleGroup,
  });
  useHandle(props.handle, lines, scroller, keys.go, onToggleGroup, (index) =>
    virtual.scrollToIndex(index, { align: "start" }),
  );
  const tracks = columns.map((one) => one.track).join(" ");
  const active = lines[keys.at];
  return (
    <div
      ref={scroller}
      className={`${classes.grid} bench`}
      role="treegrid"
      tabIndex={0}
      aria-label={t("page.table.label")}
      aria-rowcount={lines.length + 1}
      aria-activedescendant={active ? `line-${keyOf(active)}` : undefined}
      data-testid="parameters"
      data-side={bench.side}
      onKeyDown={keys.onKeyDown}
    >
      <Head columns={columns} tracks={tracks} sorting={props.sorting} onSort={props.onSort} />
      <div role="rowgroup" className={classes.lines} style={{ height: virtual.getTotalSize() }}>
        {virtual.getVirtualItems().map((item) => {
          const line = lines[item.index];
          if (!line) return null;
          const place = { index: item.index, top: item.start, active: item.index === keys.at };
          if (line.kind === "group")
            return (
              <GroupRow
                key={item.index % SLOTS}
                line={line}
                tally={props.tally.get(line.id)}
                onToggle={onToggleGroup}
                {...place}
              />
            );
          const { address } = line.row.entry;
          return (
            <EntryRow
              key={item.index % SLOTS}
              row={line.row}
              columns={columns}
              tracks={tracks}
              nowMs={nowMs}
              silent={silent}
              editing={editing?.address === address ? editing.slug : null}
              activeSlug={place.active ? keys.slug : null}
              opened={props.opened === address}
              onActive={keys.go}
              onEdit={edit}
              onEdited={done}
              onOpen={onOpen}
              {...place}
            />
          );
        })}
      </div>
      {lines.length === 0 && <p className={classes.empty}>{t("page.table.none_match")}</p>}
    </div>
  );
});

/** A number is edited where it stands; everything else opens its details. */
function useEdit(
  { role, recorded, devices }: ReturnType<typeof useBenchOfTable>,
  lines: readonly Line[],
  onOpen: (address: string, slug: string) => void,
  begin: (editing: Editing) => void,
): (address: string, slug: string) => void {
  const latest = useRef({ lines, role, recorded, onOpen });
  useEffect(() => {
    latest.current = { lines, role, recorded, onOpen };
  });
  const first = devices[0];
  return useMemo(
    () => (address, slug) => {
      const entry = first?.doc.entries.find((one) => one.address === address);
      const { role: now, recorded: shut } = latest.current;
      if (entry && isInline(entry) && lockOf(entry, now, shut) === null) begin({ address, slug });
      else latest.current.onOpen(address, slug);
    },
    [first, begin],
  );
}

/** Lets the toolbar go to a group, and back into the table. */
function useHandle(
  handle: Props["handle"],
  lines: readonly Line[],
  scroller: RefObject<HTMLDivElement | null>,
  go: (index: number) => void,
  onToggleGroup: Props["onToggleGroup"],
  scrollToTop: (index: number) => void,
): void {
  useImperativeHandle(handle, () => ({
    focus: () => scroller.current?.focus(),
    jumpTo: (group) => {
      const index = lines.findIndex((line) => line.kind === "group" && line.id === group);
      const line = lines[index];
      if (line?.kind !== "group") return;
      if (!line.open) onToggleGroup(group, true);
      go(index);
      scrollToTop(index);
      scroller.current?.focus();
    },
  }));
}

interface HeadProps {
  columns: readonly ColumnSpec[];
  tracks: string;
  sorting: Sorting | null;
  onSort: (sort: string | undefined) => void;
}

const Head = memo(function Head({ columns, tracks, sorting, onSort }: HeadProps) {
  const t = useTexts();
  return (
    <div className={classes.head} role="row" aria-rowindex={1} style={{ gridTemplateColumns: tracks }}>
      {columns.map(({ id, column, label }) => {
        const direction = sorting?.id === id ? (sorting.descending ? "descending" : "ascending") : "none";
        const Arrow = direction === "descending" ? IconArrowDown : IconArrowUp;
        const star = column === Column.Star;
        return (
          <div key={id} role="columnheader" aria-sort={direction}>
            <button
              type="button"
              onClick={() => onSort(nextSorting(id, sorting))}
              aria-label={star ? t("page.table.column.star") : undefined}
              data-testid={`sort-${id}`}
            >
              {star ? "★" : label}
              {direction !== "none" && <Arrow size={14} aria-hidden />}
            </button>
          </div>
        );
      })}
    </div>
  );
});

export function keyOf(line: Line): string {
  return line.kind === "group" ? `group-${line.id}` : line.row.entry.address;
}
