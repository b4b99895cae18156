import { ActionIcon, Menu, TextInput, Tooltip } from "@mantine/core";
import {
  IconArrowDown,
  IconArrowUp,
  IconCopy,
  IconDownload,
  IconFilter,
  IconTable,
} from "@tabler/icons-react";
import { useVirtualizer } from "@tanstack/react-virtual";
import { type ReactNode, useMemo, useRef, useState } from "react";
import { usePageSearch } from "../../frame/search";
import { useTexts } from "../../texts/texts";
import { notify } from "../../ui/notices";
import { csvOf, download, tsvOf } from "../parameters/export";
import classes from "./Bus.module.css";

const ROW_PX = 30;

export interface DataColumn<T> {
  id: string;
  width: string;
  /** What it is sorted by and what stands in the file; the filter looks here. */
  text: (row: T) => string;
  order?: (row: T) => number;
  show?: (row: T) => ReactNode;
}

interface Props<T> {
  name: string;
  rows: readonly T[];
  columns: readonly DataColumn<T>[];
  keyOf: (row: T) => string;
  onOpen?: (row: T) => void;
  tone?: (row: T) => string;
  tools?: ReactNode;
}

/** A table of what was seen: instant filter, order, copy and file; only what is in sight is in the document. */
export function DataTable<T>({ name, rows, columns, keyOf, onOpen, tone, tools }: Props<T>) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const wanted = (search.q ?? "").trim().toLowerCase();
  const [sortId, descending] = search.sort?.startsWith("-")
    ? [search.sort.slice(1), true]
    : [search.sort, false];
  const sort = columns.find((column) => column.id === sortId);
  const shown = useMemo(() => {
    const found = rows.filter((row) =>
      columns.some((column) => column.text(row).toLowerCase().includes(wanted)),
    );
    if (!sort) return found;
    const { order, text } = sort;
    found.sort((a, b) => (order ? order(a) - order(b) : text(a).localeCompare(text(b), t.language)));
    return descending ? found.reverse() : found;
  }, [rows, columns, wanted, sort, descending, t.language]);
  const tracks = columns.map((column) => column.width).join(" ");
  const order = (id: string) => {
    const next = sortId !== id ? id : descending ? undefined : `-${id}`;
    update({ sort: next });
  };
  return (
    <>
      <div className={classes.toolbar} role="toolbar" aria-label={t("trace.page.filters")}>
        <TextInput
          aria-label={t("trace.table.filter")}
          placeholder={t("trace.table.filter")}
          leftSection={<IconFilter size={16} aria-hidden />}
          className={classes.grow ?? ""}
          value={search.q ?? ""}
          onChange={(event) => update({ q: event.currentTarget.value || undefined })}
          data-testid="bus-filter"
        />
        {tools}
        <span className={classes.spacer} />
        <TableMenu name={name} columns={columns} rows={shown} />
      </div>
      <Body
        {...{ name, columns, keyOf, onOpen, tone, tracks }}
        rows={shown}
        head={columns.map((column) => (
          <button
            key={column.id}
            type="button"
            role="columnheader"
            aria-sort={sortId !== column.id ? "none" : descending ? "descending" : "ascending"}
            onClick={() => order(column.id)}
            data-testid={`sort-${column.id}`}
          >
            {t(`trace.column.${column.id}`)}
            {sortId === column.id && (descending ? <IconArrowDown size={13} /> : <IconArrowUp size={13} />)}
          </button>
        ))}
        empty={t(rows.length === 0 ? "trace.table.none" : "trace.table.none_match")}
      />
    </>
  );
}

interface BodyProps<T> extends Pick<Props<T>, "name" | "rows" | "columns" | "keyOf"> {
  onOpen: ((row: T) => void) | undefined;
  tone: ((row: T) => string) | undefined;
  tracks: string;
  head: ReactNode;
  empty: string;
}

function Body<T>({ name, rows, columns, keyOf, onOpen, tone, tracks, head, empty }: BodyProps<T>) {
  const t = useTexts();
  const scroller = useRef<HTMLDivElement>(null);
  const [active, setActive] = useState(0);
  const virtual = useVirtualizer({
    count: rows.length,
    getScrollElement: () => scroller.current,
    estimateSize: () => ROW_PX,
    overscan: 8,
    scrollPaddingStart: ROW_PX + 10,
  });
  const go = (to: number) => {
    const next = Math.max(0, Math.min(rows.length - 1, to));
    setActive(next);
    virtual.scrollToIndex(next);
  };
  return (
    <div
      ref={scroller}
      className={`${classes.table} bench`}
      role="grid"
      aria-label={t(`trace.tab.${name}`)}
      aria-rowcount={rows.length + 1}
      tabIndex={0}
      data-testid={`table-${name}`}
      onKeyDown={(event) => {
        const row = rows[active];
        if (event.target !== scroller.current) return;
        if (event.key === "ArrowDown") go(active + 1);
        else if (event.key === "ArrowUp") go(active - 1);
        else if (event.key === "Enter" && row !== undefined) onOpen?.(row);
        else return;
        event.preventDefault();
      }}
    >
      <div className={classes.tableHead} role="row" style={{ gridTemplateColumns: tracks }}>
        {head}
      </div>
      <div role="rowgroup" className={classes.lines} style={{ height: virtual.getTotalSize() }}>
        {virtual.getVirtualItems().map((item) => {
          const row = rows[item.index];
          if (row === undefined) return null;
          return (
            <div
              key={keyOf(row)}
              role="row"
              aria-rowindex={item.index + 2}
              className={classes.tableRow}
              data-tone={tone?.(row)}
              data-active={item.index === active}
              data-testid={`${name}-${keyOf(row)}`}
              style={{ transform: `translateY(${String(item.start)}px)`, gridTemplateColumns: tracks }}
              onClick={() => {
                setActive(item.index);
                onOpen?.(row);
              }}
            >
              {columns.map((column) => (
                <span key={column.id} role="gridcell" className={classes.clip} title={column.text(row)}>
                  {column.show ? column.show(row) : column.text(row)}
                </span>
              ))}
            </div>
          );
        })}
      </div>
      {rows.length === 0 && <p className={classes.empty}>{empty}</p>}
    </div>
  );
}

function TableMenu<T>({ name, columns, rows }: Pick<Props<T>, "name" | "columns" | "rows">) {
  const t = useTexts();
  const lines = () => [
    columns.map((column) => t(`trace.column.${column.id}`)),
    ...rows.map((row) => columns.map((column) => column.text(row))),
  ];
  const copy = () => {
    const done = () =>
      notify({ tone: "ok", title: t("trace.page.copied", { rows: rows.length }), lines: [] });
    const failed = () => notify({ tone: "error", title: t("trace.page.copy_failed"), lines: [] });
    navigator.clipboard.writeText(tsvOf(lines())).then(done, failed);
  };
  return (
    <Menu position="bottom-end">
      <Menu.Target>
        <Tooltip label={t("trace.page.export")}>
          <ActionIcon aria-label={t("trace.page.export")}>
            <IconTable size={18} aria-hidden />
          </ActionIcon>
        </Tooltip>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Item mih={40} leftSection={<IconCopy size={17} aria-hidden />} onClick={copy}>
          {t("trace.page.copy")}
        </Menu.Item>
        <Menu.Item
          mih={40}
          leftSection={<IconDownload size={17} aria-hidden />}
          onClick={() => download(`bus-${name}.csv`, csvOf(lines()))}
        >
          {t("trace.page.export")}
        </Menu.Item>
      </Menu.Dropdown>
    </Menu>
  );
}
