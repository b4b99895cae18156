import { IconStar, IconStarFilled } from "@tabler/icons-react";
import { memo } from "react";
import type { EntryDoc } from "../../api/types";
import { useCell } from "../../live/live";
import type { ParameterRow } from "../../model/rows";
import { type DeviceContext, limitText, lineOf, shownOf } from "../../model/shown";
import { defaultOf, isHex, quantityOf } from "../../model/values";
import { isUnsaved } from "./cellValue";
import { Column, type ColumnSpec } from "./columns";
import { useBenchOfTable } from "./context";
import { detailsOf, lastChangeOf } from "./history";
import classes from "./Parameters.module.css";
import { ValueCell, type ValueCellProps } from "./ValueCell";

const DASH = "–";

interface CellProps extends Omit<ValueCellProps, "device" | "editing"> {
  spec: ColumnSpec;
  /** Slug of the device whose value is edited in this row. */
  editing: string | null;
  onOpen: (address: string, slug: string) => void;
}

export const TableCell = memo(function TableCell({ spec, editing, onOpen, ...props }: CellProps) {
  const { row } = props;
  const { entry } = row;
  const { device } = spec;
  switch (spec.column) {
    case Column.Star:
      return <StarCell row={row} t={device.t} />;
    case Column.Address:
      return <span className={classes.address}>{entry.address}</span>;
    case Column.Name:
      return <NameCell row={row} t={device.t} onOpen={(address) => onOpen(address, device.slug)} />;
    case Column.Unit:
      return <span className="dim">{isHex(entry) ? "" : quantityOf(entry, device.lookup).unit}</span>;
    case Column.Ram:
      return <ValueCell {...props} device={device} editing={editing === device.slug} />;
    case Column.Stored:
      return <StoredCell entry={entry} device={device} />;
    case Column.Default:
      return <DefaultCell entry={entry} device={device} />;
    case Column.Limits:
      return (
        <span className={`${classes.clip} dim`} title={limitText(entry, device, true)}>
          {limitText(entry, device, false)}
        </span>
      );
    case Column.Access:
      return (
        <span className="dim" title={device.t(`page.access.${entry.access.replace("(w)", "_factory")}`)}>
          {entry.access}
        </span>
      );
    case Column.Changed:
      return <ChangedCell address={entry.address} t={device.t} />;
    case Column.Section:
      return <span className="dim">{entry.section}</span>;
  }
});

type Texts = DeviceContext["t"];

function StarCell({ row, t }: { row: ParameterRow; t: Texts }) {
  const { starred, toggleStar } = useBenchOfTable();
  const { address } = row.entry;
  const on = starred.has(address);
  const Star = on ? IconStarFilled : IconStar;
  return (
    <button
      type="button"
      tabIndex={-1}
      className={classes.star}
      aria-label={t("page.favourites.star", { name: row.title })}
      aria-pressed={on}
      data-testid={`star-${address}`}
      onClick={() => toggleStar(address)}
    >
      <Star size={16} aria-hidden />
    </button>
  );
}

/** Where both names do not fit, that of the object gives way: its lines differ in the other. */
function NameCell({ row, t, onOpen }: { row: ParameterRow; t: Texts; onOpen: (address: string) => void }) {
  return (
    <button
      type="button"
      tabIndex={-1}
      className={classes.name}
      title={row.title}
      aria-label={t("page.table.open", { name: row.title })}
      data-testid={`open-${row.entry.address}`}
      onClick={() => onOpen(row.entry.address)}
    >
      {row.objectName !== null && <span className={classes.clip}>{row.objectName}</span>}
      {row.objectName !== null && <span className={classes.colon}>:</span>}
      <span className={classes.own}>{row.ownName}</span>
    </button>
  );
}

function StoredCell({ entry, device }: { entry: EntryDoc; device: DeviceContext }) {
  const { t } = device;
  const cell = useCell(device.slug, entry.address);
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
  const shown = shownOf(entry, cell.stored.raw, device);
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

function DefaultCell({ entry, device }: { entry: EntryDoc; device: DeviceContext }) {
  const raw = defaultOf(entry, device.node);
  if (raw === null) return <span className="dim">{DASH}</span>;
  const shown = shownOf(entry, raw, device);
  return (
    <span className={`${classes.clip} dim`} title={`${lineOf(shown)}\n${raw}`}>
      {shown.text}
    </span>
  );
}

/** When, who, from what; of several devices the latest. */
function ChangedCell({ address, t }: { address: string; t: Texts }) {
  const bench = useBenchOfTable();
  const { side, nameOf } = bench;
  const last = lastChangeOf(address, bench);
  if (last === null) return <span className="dim">{DASH}</span>;
  const details = { ...detailsOf(last.change, t), device: nameOf(last.slug) };
  return (
    <span
      className={`${classes.clip} dim`}
      title={t(side ? "page.history.line_of" : "page.history.line", details)}
    >
      {details.when} {details.person}
    </span>
  );
}
