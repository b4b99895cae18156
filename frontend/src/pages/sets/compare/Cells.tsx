import { IconExternalLink } from "@tabler/icons-react";
import { Link } from "@tanstack/react-router";
import type { CellDoc, RowDoc } from "../../../api/compare";
import { type PageSearch, roomSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { useQuery } from "@tanstack/react-query";
import { turbineQuery } from "../../../api/queries";
import { placesOf } from "../../../ui/devices";
import { parameterSearch } from "../../../ui/ReadingText";
import { cellText, type ColumnContext, deltaText, rawText } from "./compared";
import classes from "./Compare.module.css";
import type { BitRow, FactsLine } from "./lines";
import { type Against, Mark, marksOf } from "./marks";
import { type Absence, AbsenceText } from "./signs";

interface ValueProps {
  row: RowDoc;
  cell: CellDoc;
  column: ColumnContext;
  mark: Mark | undefined;
  reference: CellDoc["raw"];
}

/** A value in its unit, raw on hover; what differs has a sign of its own, and by how much. */
export function ValueCell({ row, cell, column, mark, reference }: ValueProps) {
  const t = useTexts();
  if (cell.state !== "value")
    return (
      <div role="gridcell" data-mark={Mark.Apart}>
        <AbsenceText why={absenceOf(cell.state, column)} reason={cell.reason} />
      </div>
    );
  const text = cellText(row, column.at, t);
  const different = mark === Mark.Different;
  const delta = different && !row.rescaled ? deltaText(row, cell.raw, reference, column) : "";
  return (
    <div
      role="gridcell"
      data-mark={row.state === "not-comparable" ? row.state : mark}
      title={t("page.compare.cell_title", { value: text, raw: rawText(row, cell, column) })}
      data-testid={`cell-${row.address}-${column.at}`}
    >
      {different && row.state !== "not-comparable" && (
        <span className={classes.unequal}>
          <span aria-hidden>≠</span>
          <span className="visually-hidden">{t("page.compare.row.different")}</span>
        </span>
      )}
      <span className={classes.value}>{text}</span>
      {delta !== "" && <small className={classes.delta}>{delta}</small>}
    </div>
  );
}

/** A description without a default is no set that lacks something. */
const absenceOf = (state: Absence, { column }: ColumnContext): Absence =>
  column.kind === "default" && state === "not-in-set" ? "no-default" : state;

/** The cells before the name stay empty in the lines of details. */
function Blank({ pickable }: { pickable: boolean }) {
  return (
    <>
      {pickable && <div role="gridcell" />}
      <div role="gridcell" />
    </>
  );
}

/** One bit of a mask, or one field of bits, in every column. */
export function BitCells({ line, against, pickable }: { line: BitRow; against: Against; pickable: boolean }) {
  const t = useTexts();
  const { bit } = line;
  const name = bit.text_key === null ? t("page.compare.bit_unnamed") : t(bit.text_key);
  const marks = marksOf(bit.values, against);
  const number = bit.last === bit.bit ? `${bit.bit}` : `${bit.bit}–${bit.last}`;
  return (
    <>
      <Blank pickable={pickable} />
      <div role="gridcell" data-column="name" className={classes.bit}>
        <small>{t("page.compare.bit", { bit: number })}</small>
        <span className={classes.own} title={name}>
          {name}
        </span>
      </div>
      <div role="gridcell">{bit.clamp}</div>
      {bit.values.map((value, at) => (
        <div key={at} role="gridcell" data-mark={marks[at]}>
          <BitState value={value} field={bit.last !== bit.bit} />
        </div>
      ))}
    </>
  );
}

function BitState({ value, field }: { value: number | null; field: boolean }) {
  const t = useTexts();
  if (value === null) return <span className="dim">–</span>;
  if (field) return <span>{value}</span>;
  return (
    <span className={classes.bitState} data-on={value !== 0}>
      <i aria-hidden>{value === 0 ? "○" : "●"}</i> {t(value === 0 ? "page.compare.off" : "page.compare.on")}
    </span>
  );
}

/** What the objects themselves hold, and the way to the parameter. */
export function FactsCells({
  line,
  columns,
  pickable,
}: {
  line: FactsLine;
  columns: readonly ColumnContext[];
  pickable: boolean;
}) {
  const t = useTexts();
  const { row } = line.compared;
  const connected = placesOf(useQuery(turbineQuery).data).map((place) => place.device.slug);
  const device = columns.map((one) => one.column.device).find((slug) => connected.includes(slug));
  return (
    <>
      <Blank pickable={pickable} />
      <div role="gridcell" data-column="name" className={classes.facts}>
        {device !== undefined && (
          <Link
            to="/parameters"
            search={(before: PageSearch) => roomSearch(before, parameterSearch(device, row.address))}
            data-testid={`parameter-${row.address}`}
          >
            <IconExternalLink size={15} aria-hidden /> {t("page.compare.to_parameter")}
          </Link>
        )}
      </div>
      <div role="gridcell" className="dim">
        {t("page.compare.raw")}
      </div>
      {row.cells.map((cell, at) => {
        const column = columns[at];
        return (
          <div key={at} role="gridcell" className={classes.raw}>
            {column && cell.state === "value" ? rawText(row, cell, column) : cell.reason || "–"}
          </div>
        );
      })}
    </>
  );
}
