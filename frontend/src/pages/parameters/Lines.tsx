import { IconChevronDown, IconChevronRight } from "@tabler/icons-react";
import { memo } from "react";
import type { GroupLine, GroupTally, ParameterRow } from "../../model/rows";
import { useTexts } from "../../texts/texts";
import { TableCell } from "./Cells";
import { Column, type ColumnSpec } from "./columns";
import classes from "./Parameters.module.css";

interface Place {
  index: number;
  /** Pixels from the top of the body. */
  top: number;
  active: boolean;
}

interface EntryRowProps extends Place {
  row: ParameterRow;
  columns: readonly ColumnSpec[];
  tracks: string;
  nowMs: number;
  silent: ReadonlySet<string>;
  editing: string | null;
  /** The device whose value the arrow keys stand on. */
  activeSlug: string | null;
  opened: boolean;
  onActive: (index: number) => void;
  onEdit: (address: string, slug: string) => void;
  onEdited: () => void;
  onOpen: (address: string, slug: string) => void;
}

export const EntryRow = memo(function EntryRow(props: EntryRowProps) {
  const { row, columns, tracks, top, index, active, activeSlug } = props;
  return (
    <div
      id={`line-${row.entry.address}`}
      role="row"
      aria-level={2}
      aria-rowindex={index + 2}
      className={classes.row}
      data-active={active}
      data-opened={props.opened}
      style={{ transform: `translateY(${top}px)`, gridTemplateColumns: tracks }}
      onClick={() => props.onActive(index)}
    >
      {columns.map((spec) => (
        <div
          key={spec.id}
          role="gridcell"
          data-column={spec.column}
          data-at={active && spec.column === Column.Ram && spec.device.slug === activeSlug}
        >
          <TableCell
            spec={spec}
            row={row}
            nowMs={needsClock(spec.column) ? props.nowMs : 0}
            silent={props.silent.has(spec.device.slug)}
            editing={spec.column === Column.Ram ? props.editing : null}
            onEdit={props.onEdit}
            onEdited={props.onEdited}
            onOpen={props.onOpen}
          />
        </div>
      ))}
    </div>
  );
});

/** Only values have an age; all other cells stay as they are from second to second. */
const needsClock = (column: Column): boolean => column === Column.Ram;

interface GroupRowProps extends Place {
  line: GroupLine;
  tally: { pending: number; different: number } | undefined;
  onToggle: (id: string) => void;
}

export const GroupRow = memo(function GroupRow({ line, tally, top, index, active, onToggle }: GroupRowProps) {
  const t = useTexts();
  const Chevron = line.open ? IconChevronDown : IconChevronRight;
  return (
    <div
      id={`line-group-${line.id}`}
      role="row"
      aria-level={1}
      aria-expanded={line.open}
      aria-rowindex={index + 2}
      className={classes.group}
      data-active={active}
      style={{ transform: `translateY(${top}px)` }}
    >
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
          <Tally tally={tally} t={t} />
        </button>
      </div>
    </div>
  );
});

export function Tally({
  tally,
  t,
}: {
  tally: GroupTally extends ReadonlyMap<string, infer T> ? T | undefined : never;
  t: ReturnType<typeof useTexts>;
}) {
  if (!tally) return null;
  return (
    <>
      {tally.pending > 0 && (
        <span className={classes.tallyPending}>
          ✎ {t("page.table.group_pending", { count: tally.pending })}
        </span>
      )}
      {tally.different > 0 && (
        <span className="dim">≠ {t("page.table.group_different", { count: tally.different })}</span>
      )}
    </>
  );
}
