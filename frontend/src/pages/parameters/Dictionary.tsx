import { useCallback, useEffect, useMemo, useRef, useState } from "react";
import { usePageSearch } from "../../frame/search";
import { filterRows, rowsOf } from "../../model/rows";
import { useTexts } from "../../texts/texts";
import { columnsOf, HIDDEN_AT_FIRST, sortingOf, sortRows } from "./columns";
import { DeviceContextOfTable, useBenchOfTable, useDevice } from "./context";
import { DetailPanel } from "./DetailPanel";
import { useChanges } from "./history";
import { Legend } from "./Legend";
import { filterOnly, type Only, readOnly, tallyOf, writeOnly } from "./only";
import classes from "./Parameters.module.css";
import { ParameterTable, type TableHandle } from "./ParameterTable";
import { StateLine } from "./StateLine";
import { useStaged } from "./staging";
import type { Visible } from "./TableMenu";
import { Toolbar } from "./Toolbar";
import { useCoarseVersion, useSilentSlugs } from "./versions";

const NO_GROUPS: ReadonlySet<string> = new Set();

/** The table of one device, or of all of a kind side by side, with its tools and the details of one parameter. */
export function Dictionary() {
  const [search, update] = usePageSearch();
  const bench = useBenchOfTable();
  const { slug } = useDevice();
  const handle = useRef<TableHandle>(null);
  const [typed, setTyped] = useFilter(search.q ?? "", (q) => update({ q: q === "" ? undefined : q }));
  const table = useRowsShown(typed);
  const { columns, rows, all } = table;
  const visible: Visible = useRef({ rows, columns });
  useEffect(() => {
    visible.current = { rows, columns };
  }, [rows, columns]);
  const { closed, toggleGroup } = useGroups(typed !== "");
  const onOpen = useCallback(
    (edit: string, device?: string) => update(device === undefined ? { edit } : { edit, device }),
    [update],
  );
  const onSort = useCallback((sort: string | undefined) => update({ sort }), [update]);
  const opened = useMemo(() => all.find((row) => row.entry.address === search.edit), [all, search.edit]);
  const onOnly = useCallback((next: ReadonlySet<Only>) => update({ only: writeOnly(next) }), [update]);
  const onHide = useCallback(
    (ids: string[]) => update({ hide: ids.length === 0 ? "none" : ids.join() }),
    [update],
  );
  const onEnter = useCallback(() => handle.current?.focus(), []);
  const onJump = useCallback((group: string) => handle.current?.jumpTo(group), []);
  const close = () => {
    update({ edit: undefined });
    handle.current?.focus();
  };
  return (
    <>
      <Toolbar
        filter={typed}
        onFilter={setTyped}
        onEnter={onEnter}
        only={table.only}
        onOnly={onOnly}
        hidden={table.hidden}
        onHide={onHide}
        visible={visible}
        tally={table.tally}
        onJump={onJump}
      />
      {bench.devices.map((device) => (
        <DeviceContextOfTable key={device.slug} value={device}>
          <StateLine slug={device.slug} name={bench.side ? bench.nameOf(device.slug) : null} />
        </DeviceContextOfTable>
      ))}
      <div className={classes.body}>
        <ParameterTable
          rows={rows}
          columns={columns}
          tally={table.tally}
          silent={useSilentSlugs(bench.devices)}
          sorting={table.sorting}
          closed={closed}
          opened={opened?.entry.address}
          handle={handle}
          onSort={onSort}
          onToggleGroup={toggleGroup}
          onOpen={onOpen}
        />
        {opened && (
          <DetailPanel
            row={opened}
            onDevice={(device) => update({ device })}
            onOpen={onOpen}
            onClose={close}
            key={bench.side ? "side" : slug}
          />
        )}
      </div>
      <Legend shown={rows.length} total={all.length} />
    </>
  );
}

/** The rows after all filters, in their order, and what the groups have to say. */
function useRowsShown(typed: string) {
  const t = useTexts();
  const [search] = usePageSearch();
  const bench = useBenchOfTable();
  const { doc } = useDevice();
  const staged = useStaged();
  const slugs = useMemo(() => bench.siblings.map((one) => one.slug), [bench.siblings]);
  const version = useCoarseVersion(slugs);
  const changes = useChanges(slugs);
  const all = useMemo(() => rowsOf(doc, t), [doc, t]);
  const found = useMemo(() => filterRows(all, typed), [all, typed]);
  const only = useMemo(() => readOnly(search.only), [search.only]);
  const relevant = only.size === 0 ? 0 : version;
  const left = useMemo(
    () => filterOnly(found, only, bench, staged),
    // The store is read afresh whenever values of the devices came.
    // eslint-disable-next-line react-hooks/exhaustive-deps
    [found, only, bench, staged, relevant],
  );
  const hidden = useMemo(
    () => (search.hide === undefined ? HIDDEN_AT_FIRST : search.hide.split(",")),
    [search.hide],
  );
  const columns = useMemo(
    () => columnsOf(bench, hidden, t),
    // A new change shows in the cells of its column.
    // eslint-disable-next-line react-hooks/exhaustive-deps
    [bench, hidden, t, changes],
  );
  const sorting = useMemo(() => sortingOf(search.sort), [search.sort]);
  const rows = useMemo(() => sortRows(left, sorting, columns, bench), [left, sorting, columns, bench]);
  const tally = useMemo(
    () => tallyOf(all, bench, staged),
    // eslint-disable-next-line react-hooks/exhaustive-deps
    [all, bench, staged, version],
  );
  return { all, rows, columns, hidden, only, sorting, tally };
}

/** Which groups are closed; while a filter is typed all are open, so that what it finds is seen. */
function useGroups(filtering: boolean) {
  const [search, update] = usePageSearch();
  const closed = useMemo(
    () => (filtering || !search.closed ? NO_GROUPS : new Set(search.closed.split(","))),
    [filtering, search.closed],
  );
  const toggleGroup = useCallback(
    (id: string, open = closed.has(id)) => {
      const next = new Set(closed);
      if (open) next.delete(id);
      else next.add(id);
      update({ closed: next.size === 0 ? undefined : [...next].join() });
    },
    [closed, update],
  );
  return { closed, toggleGroup };
}

const URL_DELAY_MS = 300;

/** What is typed is shown at once; the URL follows when the typing pauses. */
function useFilter(inUrl: string, write: (filter: string) => void): [string, (typed: string) => void] {
  const [typed, setTyped] = useState(inUrl);
  const latest = useRef(write);
  useEffect(() => {
    latest.current = write;
  });
  useEffect(() => {
    if (typed === inUrl) return;
    const timer = setTimeout(() => latest.current(typed), URL_DELAY_MS);
    return () => clearTimeout(timer);
    // The URL is an outcome here, never a cause.
    // eslint-disable-next-line react-hooks/exhaustive-deps
  }, [typed]);
  return [typed, setTyped];
}
