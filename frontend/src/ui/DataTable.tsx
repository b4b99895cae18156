import { CloseButton, TextInput } from "@mantine/core";
import { IconArrowDown, IconArrowUp, IconFilter } from "@tabler/icons-react";
import { type KeyboardEvent, type ReactNode, useDeferredValue, useEffect, useRef } from "react";
import { usePageSearch } from "../frame/search";
import { useTexts } from "../texts/texts";
import classes from "./DataTable.module.css";
import { type ArrangedTable, leastWidth, type TableColumn, useArranged } from "./arrange";
import { TableBody } from "./TableBody";
import { TableMenu } from "./TableMenu";
import { useHeld } from "./useHeld";
import { useTyped } from "./useTyped";

export type { TableColumn } from "./arrange";

interface Props<Row> {
  label: string;
  rows: readonly Row[];
  columns: readonly TableColumn<Row>[];
  idOf: (row: Row) => string;
  /** File name of an export, without its ending. */
  fileName: string;
  empty: ReactNode;
  onOpen?: (row: Row) => void;
  /** By a double click, and by Enter on the row that is open. */
  onRun?: (row: Row) => void;
  selected?: string | undefined;
  tools?: ReactNode;
  /** Columns that are hidden until somebody chooses. */
  hiddenFirst?: readonly string[];
  /** What the rows are called in tests. */
  name?: string;
  /** Low rows, for much that is only looked at. */
  dense?: boolean;
  /** Heads of up to three lines, for many narrow columns. */
  tallHead?: boolean;
  /** Its values change all the time: the order is held while somebody is among the rows. */
  live?: boolean;
  toneOf?: (row: Row) => string;
}

const NO_COLUMNS: readonly string[] = [];
const GAP_PX = 12;
const HEAD_PX = 41;
const TALL_HEAD_PX = 63;

/** A table with filter, order, choice of columns, copy, export and keyboard; only the rows in view are drawn. */
export function DataTable<Row>(props: Props<Row>) {
  const { label, rows, columns, idOf, fileName, empty, tools } = props;
  const { name = "row", dense = false, live = false, tallHead = false, hiddenFirst = NO_COLUMNS } = props;
  const t = useTexts();
  const [search, update] = usePageSearch();
  const [typed, setTyped] = useTyped(search.find ?? "", (text) => update({ find: text }));
  // The letter first, then the rows.
  const find = useDeferredValue(typed);
  const view = { find, order: search.order, less: search.less };
  const table = useArranged({ rows, columns, idOf, view, onView: update, hiddenFirst });
  const section = useRef<HTMLElement>(null);
  const found = table.getRowModel().rows.map((line) => line.original.row);
  const { rows: shown, hold } = useHeld(found, idOf, `${search.order ?? ""} ${find}`, live);
  const visible = columns.filter((column) => table.getColumn(column.id)?.getIsVisible() !== false);
  const look = {
    gridTemplateColumns: visible.map((column) => column.width).join(" "),
    minWidth: leastWidth(visible, GAP_PX),
  };
  const texts = () => [
    visible.map((column) => column.title),
    ...shown.map((row) => visible.map((column) => column.text(row))),
  ];
  const enters = useRef(false);
  const settled = find === typed;
  useEffect(() => {
    if (!settled || !enters.current) return;
    enters.current = false;
    focusRow(section.current);
  }, [settled]);
  const onFilterKey = (event: KeyboardEvent) => {
    if (event.key !== "Enter" && event.key !== "ArrowDown") return;
    event.preventDefault();
    // Not into rows that the last letters are about to take away.
    if (settled) focusRow(section.current);
    else enters.current = true;
  };
  return (
    <section
      ref={section}
      className={classes.table}
      aria-label={label}
      data-dense={dense}
      data-tall={tallHead}
    >
      <div className={classes.tools} role="toolbar" aria-label={t("page.table.tools")}>
        <TextInput
          className={classes.filter ?? ""}
          aria-label={t("page.files.filter")}
          placeholder={t("page.files.filter")}
          leftSection={<IconFilter size={17} aria-hidden />}
          rightSectionWidth={40}
          rightSection={
            typed !== "" && (
              <CloseButton aria-label={t("page.table.clear_filter")} onClick={() => setTyped("")} />
            )
          }
          value={typed}
          onChange={(event) => setTyped(event.currentTarget.value)}
          onKeyDown={onFilterKey}
          data-testid="find"
        />
        <span className={classes.count} data-testid="table-count">
          {t("page.table.count", { shown: shown.length, total: rows.length })}
        </span>
        <TableMenu table={table} columns={columns} texts={texts} fileName={fileName} />
        <span className={classes.spacer} />
        {tools}
      </div>
      <TableBody
        label={label}
        name={name}
        rows={shown}
        columns={visible}
        look={look}
        dense={dense}
        headPx={tallHead ? TALL_HEAD_PX : HEAD_PX}
        idOf={idOf}
        toneOf={props.toneOf}
        onOpen={props.onOpen}
        onRun={props.onRun}
        selected={props.selected}
        hold={hold}
        head={<Head table={table} columns={visible} look={look} />}
        empty={rows.length === 0 ? empty : t("page.files.none_match")}
      />
    </section>
  );
}

const focusRow = (table: HTMLElement | null) =>
  table?.querySelector<HTMLElement>('[role="row"][tabindex="0"]')?.focus();

interface HeadProps<Row> {
  table: ArrangedTable<Row>;
  columns: readonly TableColumn<Row>[];
  look: { gridTemplateColumns: string; minWidth: number };
}

const DIRECTIONS = { asc: "ascending", desc: "descending" } as const;

function Head<Row>({ table, columns, look }: HeadProps<Row>) {
  return (
    <div role="rowgroup" className={classes.top} style={{ minWidth: look.minWidth }}>
      <div role="row" aria-rowindex={1} className={classes.head} style={look}>
        {columns.map(({ id, title, numeric }) => {
          const column = table.getColumn(id);
          const sorted = column?.getIsSorted() ?? false;
          const Arrow = sorted === "desc" ? IconArrowDown : IconArrowUp;
          return (
            <div key={id} role="columnheader" aria-sort={sorted === false ? "none" : DIRECTIONS[sorted]}>
              {column?.getCanSort() === true && (
                <button
                  type="button"
                  data-numeric={numeric}
                  onClick={() => column.toggleSorting()}
                  data-testid={`sort-${id}`}
                >
                  <span>{title}</span>
                  {sorted !== false && <Arrow size={14} aria-hidden />}
                </button>
              )}
            </div>
          );
        })}
      </div>
    </div>
  );
}
