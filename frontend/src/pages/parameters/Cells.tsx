import { IconPencil } from "@tabler/icons-react";
import { memo } from "react";
import type { EntryDoc, Raw } from "../../api/types";
import { useCell } from "../../live/live";
import type { Cell } from "../../live/store";
import type { ParameterRow } from "../../model/rows";
import { limitText, lineOf, shownOf } from "../../model/shown";
import { defaultOf } from "../../model/values";
import { age, timeOfDay } from "../../ui/format";
import { ageMsOf, isStale, isUnsaved, rawOf } from "./cellValue";
import { Column } from "./columns";
import { useDevice } from "./context";
import classes from "./Parameters.module.css";

const DASH = "–";
const FLASH_MS = 1500;

interface CellProps {
  row: ParameterRow;
  nowMs: number;
  silent: boolean;
  onOpen: (address: string) => void;
}

export const TableCell = memo(function TableCell({ column, ...props }: CellProps & { column: Column }) {
  const { entry } = props.row;
  switch (column) {
    case Column.Address:
      return <span className={classes.address}>{entry.address}</span>;
    case Column.Name:
      return <NameCell row={props.row} />;
    case Column.Ram:
      return <RamCell {...props} />;
    case Column.Stored:
      return <StoredCell entry={entry} />;
    case Column.Default:
      return <DefaultCell entry={entry} />;
    case Column.Limits:
      return <LimitsCell entry={entry} />;
    case Column.Access:
      return <AccessCell entry={entry} />;
    case Column.Section:
      return <span className="dim">{entry.section}</span>;
  }
});

/** Where both names do not fit, that of the object gives way: its lines differ in the other. */
function NameCell({ row }: { row: ParameterRow }) {
  return (
    <span className={classes.name} title={row.title}>
      {row.objectName !== null && <span className={classes.clip}>{row.objectName}</span>}
      {row.objectName !== null && <span className={classes.colon}>:</span>}
      <span className={classes.own}>{row.ownName}</span>
    </span>
  );
}

function RamCell({ row, nowMs, silent, onOpen }: CellProps) {
  const { t, slug } = useDevice();
  const { entry, title } = row;
  const cell = useCell(slug, entry.address);
  const key = entry.writable ? "page.table.edit" : "page.table.open";
  return (
    <button
      type="button"
      tabIndex={-1}
      className={classes.value}
      aria-label={t(key, { name: title })}
      aria-describedby={`ram-${entry.address}`}
      data-testid={`value-${entry.address}`}
      onClick={() => onOpen(entry.address)}
    >
      <RamText entry={entry} cell={cell} nowMs={nowMs} silent={silent} />
      {entry.writable && <IconPencil size={15} className={classes.pencil} aria-hidden />}
    </button>
  );
}

function RamText({
  entry,
  cell,
  nowMs,
  silent,
}: Omit<CellProps, "row" | "onOpen"> & { entry: EntryDoc; cell: Cell | undefined }) {
  const context = useDevice();
  const { t } = context;
  const raw = rawOf(cell);
  if (!cell || raw === null) {
    const text = entry.readable ? DASH : t("page.table.write_only");
    return (
      <span
        id={`ram-${entry.address}`}
        className="dim"
        title={unknownTitle(cell, entry, context)}
        data-known="false"
      >
        {text}
      </span>
    );
  }
  const shown = shownOf(entry, raw, context);
  const stale = isStale(entry, cell, nowMs, silent);
  const fresh = cell.changedAtMs !== null && nowMs - cell.changedAtMs < FLASH_MS;
  return (
    <span
      key={cell.changedAtMs}
      id={`ram-${entry.address}`}
      className={classes.ram}
      data-flash={fresh}
      data-stale={stale}
      data-unsaved={isUnsaved(entry, cell)}
      data-known="true"
      title={valueTitle(raw, cell, nowMs, shown.names.length > 0 ? lineOf(shown) : "", context)}
    >
      <b>{shown.text}</b>
      <i>{shown.names.length > 0 ? shown.names.join(", ") : shown.unit}</i>
      {stale && <em>{age(ageMsOf(cell, nowMs), t.language)}</em>}
    </span>
  );
}

type Context = ReturnType<typeof useDevice>;

function unknownTitle(cell: Cell | undefined, entry: EntryDoc, context: Context): string {
  if (!entry.readable) return context.t("page.table.write_only_title");
  return context.t(cell ? "page.table.unknown_since_restart" : "page.table.never_read");
}

function valueTitle(raw: Raw, cell: Cell, nowMs: number, line: string, { t }: Context): string {
  const source = cell.source === null ? "–" : t(`page.source.${cell.source.replaceAll("-", "_")}`);
  const time = timeOfDay((cell.t_ns ?? 0) / 1e6);
  const details = { raw, hex: cell.hex, source, time, age: age(ageMsOf(cell, nowMs), t.language) };
  return [line, t("page.table.raw_title", details)].filter(Boolean).join("\n");
}

function StoredCell({ entry }: { entry: EntryDoc }) {
  const context = useDevice();
  const { t } = context;
  const cell = useCell(context.slug, entry.address);
  if (!entry.saved) {
    return (
      <span className="dim" title={t("page.table.not_kept_title")}>
        {t("page.table.not_kept")}
      </span>
    );
  }
  if (!cell?.stored) {
    return (
      <span className="dim" title={t("page.table.stored_unknown")} data-testid={`stored-${entry.address}`}>
        {DASH}
      </span>
    );
  }
  const shown = shownOf(entry, cell.stored.raw, context);
  const state = t(`page.stored.${cell.stored.state}`);
  return (
    <span
      className={classes.stored}
      title={`${lineOf(shown)}\n${state}`}
      data-unsaved={isUnsaved(entry, cell)}
      data-state={cell.stored.state}
      data-testid={`stored-${entry.address}`}
    >
      <span aria-hidden>{cell.stored.state === "proven" ? "•" : "◦"}</span>
      <span className={classes.clip}>{shown.unit === "" ? shown.text : `${shown.text} ${shown.unit}`}</span>
      <span className="visually-hidden">{state}</span>
    </span>
  );
}

function DefaultCell({ entry }: { entry: EntryDoc }) {
  const context = useDevice();
  const raw = defaultOf(entry, context.node);
  if (raw === null) return <span className="dim">{DASH}</span>;
  const shown = shownOf(entry, raw, context);
  return (
    <span className={`${classes.clip} dim`} title={`${lineOf(shown)}\n${raw}`}>
      {shown.text}
    </span>
  );
}

function LimitsCell({ entry }: { entry: EntryDoc }) {
  const context = useDevice();
  const own = limitText(entry, context, false);
  return (
    <span className={`${classes.clip} dim`} title={limitText(entry, context, true)}>
      {own}
    </span>
  );
}

function AccessCell({ entry }: { entry: EntryDoc }) {
  const { t } = useDevice();
  return (
    <span className="dim" title={t(`page.access.${entry.access.replace("(w)", "_factory")}`)}>
      {entry.access}
    </span>
  );
}
