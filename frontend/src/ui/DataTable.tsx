import { ActionIcon, CloseButton, Menu, TextInput, Tooltip } from "@mantine/core";
import {
  IconArrowDown,
  IconArrowUp,
  IconCopy,
  IconDownload,
  IconFilter,
  IconSquare,
  IconSquareCheck,
  IconTable,
} from "@tabler/icons-react";
import { useVirtualizer } from "@tanstack/react-virtual";
import { type KeyboardEvent, type ReactNode, useMemo, useRef, useState } from "react";
import { usePageSearch } from "../frame/search";
import { csvOf, download, tsvOf } from "../pages/parameters/export";
import { useTexts } from "../texts/texts";
import classes from "./DataTable.module.css";
import { arranged, type Sortable } from "./arrange";
import { notify } from "./notices";

const ROW_PX = 40;

export interface TableColumn<Row> {
  id: string;
  title: string;
  /** Track of the CSS grid. */
  width: string;
  /** What is searched, copied and exported. */
  text: (row: Row) => string;
  cell?: (row: Row) => ReactNode;
  /** What it is sorted by, where that is not the text. */
  by?: (row: Row) => Sortable;
  /** A column that is always shown. */
  fixed?: boolean;
  numeric?: boolean;
}

interface Props<Row> {
  label: string;
  rows: readonly Row[];
  columns: readonly TableColumn<Row>[];
  idOf: (row: Row) => string;
  /** File name of an export, without its ending. */
  fileName: string;
  empty: ReactNode;
  onOpen?: (row: Row) => void;
  selected?: string | undefined;
  tools?: ReactNode;
  /** Columns that are hidden until somebody chooses. */
  hiddenFirst?: readonly string[];
}

const NONE = "none";
/** Below this width of a column the table is scrolled sideways. */
const COLUMN_PX = 88;

/** A table with filter, order, choice of columns, copy, export and keyboard; only the rows in view are drawn. */
export function DataTable<Row>(props: Props<Row>) {
  const { label, rows, columns, idOf, fileName, empty, onOpen, selected, tools, hiddenFirst = [] } = props;
  const t = useTexts();
  const [search, update] = usePageSearch();
  const hidden = search.less?.split(",") ?? hiddenFirst;
  const shown = columns.filter((column) => column.fixed === true || !hidden.includes(column.id));
  const found = useMemo(
    () => arranged(rows, columns, search.find ?? "", search.order),
    [rows, columns, search.find, search.order],
  );
  const tracks = shown.map((column) => column.width).join(" ");
  const texts = () => [
    shown.map((column) => column.title),
    ...found.map((row) => shown.map((column) => column.text(row))),
  ];
  return (
    <section className={classes.table} aria-label={label}>
      <div className={classes.tools} role="toolbar" aria-label={t("page.table.tools")}>
        <TextInput
          className={classes.filter ?? ""}
          aria-label={t("page.files.filter")}
          placeholder={t("page.files.filter")}
          leftSection={<IconFilter size={17} aria-hidden />}
          rightSectionWidth={40}
          rightSection={
            search.find !== undefined && (
              <CloseButton
                aria-label={t("page.table.clear_filter")}
                onClick={() => update({ find: undefined })}
              />
            )
          }
          value={search.find ?? ""}
          onChange={(event) => update({ find: event.currentTarget.value })}
          data-testid="find"
        />
        <span className="dim">{t("page.table.count", { shown: found.length, total: rows.length })}</span>
        <ColumnMenu columns={columns} hidden={hidden} texts={texts} fileName={fileName} />
        <span className={classes.spacer} />
        {tools}
      </div>
      <div role="table" aria-label={label} aria-rowcount={found.length + 1} className={classes.grid}>
        <div className={classes.wide} style={{ minWidth: shown.length * COLUMN_PX }}>
          <Head columns={shown} tracks={tracks} />
          {found.length === 0 ? (
            <div className={classes.empty}>{rows.length === 0 ? empty : t("page.files.none_match")}</div>
          ) : (
            <Body
              rows={found}
              columns={shown}
              tracks={tracks}
              idOf={idOf}
              onOpen={onOpen}
              selected={selected}
            />
          )}
        </div>
      </div>
    </section>
  );
}

function Head<Row>({ columns, tracks }: { columns: readonly TableColumn<Row>[]; tracks: string }) {
  const [search, update] = usePageSearch();
  const [id, descending] = [search.order?.replace(/^-/, ""), search.order?.startsWith("-") ?? false];
  const next = (column: string) => (column !== id ? column : descending ? undefined : `-${column}`);
  return (
    <div role="rowgroup">
      <div role="row" className={classes.head} style={{ gridTemplateColumns: tracks }}>
        {columns.map((column) => (
          <div
            key={column.id}
            role="columnheader"
            aria-sort={column.id !== id ? "none" : descending ? "descending" : "ascending"}
          >
            {column.title !== "" && (
              <button
                type="button"
                data-numeric={column.numeric}
                onClick={() => update({ order: next(column.id) })}
              >
                {column.title}
                {column.id === id &&
                  (descending ? (
                    <IconArrowDown size={14} aria-hidden />
                  ) : (
                    <IconArrowUp size={14} aria-hidden />
                  ))}
              </button>
            )}
          </div>
        ))}
      </div>
    </div>
  );
}

interface BodyProps<Row> extends Pick<Props<Row>, "rows" | "idOf"> {
  columns: readonly TableColumn<Row>[];
  tracks: string;
  onOpen: ((row: Row) => void) | undefined;
  selected: string | undefined;
}

function Body<Row>({ rows, columns, tracks, idOf, onOpen, selected }: BodyProps<Row>) {
  const scroller = useRef<HTMLDivElement>(null);
  const [at, setAt] = useState(0);
  const current = Math.min(at, rows.length - 1);
  const virtual = useVirtualizer({
    count: rows.length,
    getScrollElement: () => scroller.current,
    estimateSize: () => ROW_PX,
    overscan: 8,
  });
  const go = (to: number) => {
    const row = Math.max(0, Math.min(rows.length - 1, to));
    setAt(row);
    virtual.scrollToIndex(row);
    requestAnimationFrame(() => scroller.current?.querySelector<HTMLElement>(`[data-at="${row}"]`)?.focus());
  };
  const onKey = (event: KeyboardEvent) => {
    const steps: Record<string, number> = { ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10 };
    const step = steps[event.key];
    if (step !== undefined) go(current + step);
    else if (event.key === "Home") go(0);
    else if (event.key === "End") go(rows.length - 1);
    else if (event.key === "Enter" && event.target instanceof HTMLElement && event.target.role === "row") {
      const row = rows[Number(event.target.dataset.at)];
      if (row !== undefined) onOpen?.(row);
    } else return;
    event.preventDefault();
  };
  return (
    <div ref={scroller} role="rowgroup" className={classes.body} onKeyDown={onKey}>
      <div style={{ height: virtual.getTotalSize(), position: "relative" }} role="presentation">
        {virtual.getVirtualItems().map(({ index, start }) => {
          const row = rows[index];
          if (row === undefined) return null;
          return (
            <div
              key={idOf(row)}
              role="row"
              aria-rowindex={index + 2}
              aria-selected={onOpen ? idOf(row) === selected : undefined}
              data-at={index}
              data-open={onOpen !== undefined}
              data-testid={`row-${idOf(row)}`}
              tabIndex={index === current ? 0 : -1}
              className={classes.row}
              style={{ gridTemplateColumns: tracks, transform: `translateY(${start}px)`, height: ROW_PX }}
              onFocus={() => setAt(index)}
              onClick={() => {
                setAt(index);
                onOpen?.(row);
              }}
            >
              {columns.map((column) => (
                <div key={column.id} role="cell" data-numeric={column.numeric} title={column.text(row)}>
                  {column.cell ? column.cell(row) : column.text(row)}
                </div>
              ))}
            </div>
          );
        })}
      </div>
    </div>
  );
}

interface ColumnMenuProps<Row> {
  columns: readonly TableColumn<Row>[];
  hidden: readonly string[];
  texts: () => string[][];
  fileName: string;
}

function ColumnMenu<Row>({ columns, hidden, texts, fileName }: ColumnMenuProps<Row>) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const toggle = (id: string) => {
    const less = hidden.includes(id) ? hidden.filter((one) => one !== id) : [...hidden, id];
    update({ less: less.length === 0 ? NONE : less.filter((one) => one !== NONE).join() });
  };
  const copy = () => {
    const lines = texts();
    navigator.clipboard
      .writeText(tsvOf(lines))
      .then(() =>
        notify({ tone: "ok", title: t("page.table.copied", { rows: lines.length - 1 }), lines: [] }),
      )
      .catch(() => notify({ tone: "error", title: t("page.table.copy_failed"), lines: [] }));
  };
  return (
    <Menu position="bottom-start">
      <Menu.Target>
        <Tooltip label={t("page.table.menu")}>
          <ActionIcon aria-label={t("page.table.menu")} data-testid="files-menu">
            <IconTable size={18} aria-hidden />
          </ActionIcon>
        </Tooltip>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Item mih={40} leftSection={<IconCopy size={17} aria-hidden />} onClick={copy}>
          {t("page.table.copy")}
        </Menu.Item>
        <Menu.Item
          mih={40}
          leftSection={<IconDownload size={17} aria-hidden />}
          onClick={() => download(`${fileName}.csv`, csvOf(texts()))}
        >
          {t("page.table.export")}
        </Menu.Item>
        <Menu.Divider />
        <Menu.Label>{t("page.table.columns")}</Menu.Label>
        {columns
          .filter((column) => !column.fixed)
          .map((column) => {
            const off = hidden.includes(column.id);
            const Icon = off ? IconSquare : IconSquareCheck;
            return (
              <Menu.Item
                key={column.id}
                mih={40}
                role="menuitemcheckbox"
                aria-checked={!off}
                closeMenuOnClick={false}
                leftSection={<Icon size={17} aria-hidden />}
                onClick={() => toggle(column.id)}
              >
                {column.title}
              </Menu.Item>
            );
          })}
      </Menu.Dropdown>
    </Menu>
  );
}
