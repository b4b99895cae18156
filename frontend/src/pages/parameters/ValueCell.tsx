import { IconAlertTriangle, IconCircleX, IconInfoCircle, IconPencil } from "@tabler/icons-react";
import type { EntryDoc, Failure, Raw } from "../../api/types";
import { useCell } from "../../live/live";
import type { Cell } from "../../live/store";
import { lockOf } from "../../model/locks";
import type { ParameterRow } from "../../model/rows";
import { lineOfFinding } from "../../model/ruleFindings";
import { type DeviceContext, lineOf, shownOf } from "../../model/shown";
import type { Change } from "../../model/staged";
import { age, timeOfDay } from "../../ui/format";
import { ageMsOf, isStale, isUnsaved, rawOf } from "./cellValue";
import { useBenchOfTable } from "./context";
import { InlineEditor } from "./InlineEditor";
import classes from "./Parameters.module.css";
import { useMarks } from "./rules";
import rules from "./Rules.module.css";
import { plannedContext, useChange } from "./staging";

const DASH = "–";
const FLASH_MS = 1500;

export interface ValueCellProps {
  row: ParameterRow;
  device: DeviceContext;
  nowMs: number;
  silent: boolean;
  /** The value is being edited in the table. */
  editing: boolean;
  onEdit: (address: string, slug: string) => void;
  onEdited: () => void;
}

/** A value of one device: what RAM holds, how far it is kept, and what is pending. */
export function ValueCell(props: ValueCellProps) {
  const { row, device, onEdit } = props;
  const { side, role, recorded, nameOf } = useBenchOfTable();
  const { entry, title } = row;
  const cell = useCell(device.slug, entry.address);
  const change = useChange(device.slug, entry.address);
  if (props.editing)
    return <InlineEditor key={entry.address} entry={entry} device={device} onDone={props.onEdited} />;
  const { t } = device;
  const open = lockOf(entry, role, recorded) === null;
  const name = side ? `${title}, ${nameOf(device.slug)}` : title;
  const id = `ram-${device.slug}-${entry.address}`;
  return (
    <button
      type="button"
      tabIndex={-1}
      className={classes.value}
      aria-labelledby={`${id}-do ${id}`}
      data-testid={side ? `value-${device.slug}-${entry.address}` : `value-${entry.address}`}
      data-pending={change !== undefined}
      onClick={() => onEdit(entry.address, device.slug)}
    >
      <span id={`${id}-do`} className="visually-hidden">
        {t(open ? "page.table.edit" : "page.table.open", { name })}
      </span>
      <span id={id} className={classes.cellText}>
        {change ? (
          <PendingText entry={entry} device={device} change={change} cell={cell} />
        ) : (
          <RamText {...props} entry={entry} cell={cell} side={side} />
        )}
      </span>
      <RuleMark device={device} entry={entry} />
      {open && !change && <IconPencil size={15} className={classes.pencil} aria-hidden />}
    </button>
  );
}

/** The value breaks a rule; of several the gravest gives the mark, all are named. */
function RuleMark({ device, entry }: Pick<ValueCellProps, "device"> & { entry: EntryDoc }) {
  const { t } = device;
  const marks = useMarks(device.slug, entry.address);
  const [gravest] = marks;
  if (!gravest) return null;
  const titles = marks.map((one) => `${t(`rule.${one.rule}.title`)}: ${lineOfFinding(one, t)}`).join("\n");
  const Icon =
    gravest.severity === "error"
      ? IconCircleX
      : gravest.severity === "warning"
        ? IconAlertTriangle
        : IconInfoCircle;
  return (
    <span
      className={rules.mark}
      data-severity={gravest.severity}
      title={titles}
      data-testid={`rule-mark-${entry.address}`}
    >
      <Icon size={15} aria-hidden />
      <span className="visually-hidden">{titles}</span>
    </span>
  );
}

interface PendingProps {
  entry: EntryDoc;
  device: DeviceContext;
  change: Change;
  cell: Cell | undefined;
}

function PendingText({ entry, device, change, cell }: PendingProps) {
  const { t } = device;
  const from = rawOf(cell);
  const old = from === null ? DASH : shownOf(entry, from, device).text;
  const next = shownOf(entry, change.raw, plannedContext(device));
  const why = change.refused === null ? null : reasonOf(change.refused, t);
  return (
    <span
      className={classes.pending}
      data-refused={why !== null}
      title={why ?? t("page.table.pending_title", { value: lineOf(next) })}
    >
      <s>{old}</s>
      <span>{" → "}</span>
      <b>{next.text}</b>
      <span aria-hidden>{why === null ? " ✎" : " ✕"}</span>
      <span className="visually-hidden">
        {why === null ? t("page.table.pending") : t("page.table.refused", { reason: why })}
      </span>
    </span>
  );
}

export const reasonOf = (failure: Failure, t: DeviceContext["t"]): string =>
  t.has(failure.text_key) ? t(failure.text_key, failure.details) : failure.code;

interface RamProps extends Pick<ValueCellProps, "device" | "nowMs" | "silent"> {
  entry: EntryDoc;
  cell: Cell | undefined;
  side: boolean;
}

function RamText({ entry, cell, device, nowMs, silent, side }: RamProps) {
  const { t } = device;
  const raw = rawOf(cell);
  if (!cell || raw === null) {
    const why = !entry.readable ? "write_only_title" : cell ? "unknown_since_restart" : "never_read";
    return (
      <span className="dim" title={t(`page.table.${why}`)} data-known="false">
        {entry.readable ? DASH : t("page.table.write_only")}
      </span>
    );
  }
  const shown = shownOf(entry, raw, device);
  const stale = isStale(entry, cell, nowMs, silent);
  const fresh = cell.changedAtMs !== null && nowMs - cell.changedAtMs < FLASH_MS;
  return (
    <span
      key={cell.changedAtMs}
      className={classes.ram}
      data-flash={fresh}
      data-stale={stale}
      data-known="true"
      data-bits={shown.names.length > 0}
      title={valueTitle(raw, cell, nowMs, shown.names.length > 0 ? lineOf(shown) : "", device)}
    >
      <b>{shown.text}</b>
      <i>{shown.names.length > 0 ? shown.names.join(", ") : side ? "" : shown.unit}</i>
      {stale && <em>{age(ageMsOf(cell, nowMs), t.language)}</em>}
      <Mark entry={entry} cell={cell} side={side} t={t} />
    </span>
  );
}

/** How far the value is kept. One device alone has a column for what is stored. */
function Mark({
  entry,
  cell,
  side,
  t,
}: {
  entry: EntryDoc;
  cell: Cell;
  side: boolean;
  t: DeviceContext["t"];
}) {
  if (isUnsaved(entry, cell))
    return (
      <span className={classes.mark} data-state="unsaved" title={t("page.table.unsaved_title")}>
        <span aria-hidden>≠</span>
        <span className="visually-hidden">{t("page.table.unsaved_title")}</span>
      </span>
    );
  if (!side || !entry.saved || !cell.stored) return null;
  const state = t(`page.stored.${cell.stored.state}`);
  return (
    <span className={classes.mark} data-state={cell.stored.state} title={state}>
      <span aria-hidden>{cell.stored.state === "proven" ? "•" : "◦"}</span>
      <span className="visually-hidden">{state}</span>
    </span>
  );
}

function valueTitle(raw: Raw, cell: Cell, nowMs: number, line: string, { t }: DeviceContext): string {
  const source = cell.source === null ? DASH : t(`page.source.${cell.source.replaceAll("-", "_")}`);
  const time = timeOfDay((cell.t_ns ?? 0) / 1e6);
  const details = { raw, hex: cell.hex, source, time, age: age(ageMsOf(cell, nowMs), t.language) };
  return [line, t("page.table.raw_title", details)].filter(Boolean).join("\n");
}
