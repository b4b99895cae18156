import { Center, Loader } from "@mantine/core";
import type { SortingState } from "@tanstack/react-table";
import { useQuery } from "@tanstack/react-query";
import { useCallback, useDeferredValue, useEffect, useMemo, useRef, useState } from "react";
import { descriptionQuery, turbineQuery } from "../../api/queries";
import type { DescriptionDoc } from "../../api/types";
import { usePageSearch } from "../../frame/search";
import { store, useDeviceVersion, useWatchDevice } from "../../live/live";
import { filterRows, type ParameterRow, rowsOf } from "../../model/rows";
import type { DeviceContext } from "../../model/shown";
import { useTexts } from "../../texts/texts";
import { placesOf, type Place } from "../../ui/devices";
import { ProblemAlert } from "../../ui/ProblemAlert";
import { differsFromDefault, rawOf } from "./cellValue";
import { type Column, HIDDEN_AT_FIRST } from "./columns";
import { DeviceContextOfTable } from "./context";
import { DevicePicker } from "./DevicePicker";
import { EntryDialog } from "./EntryDialog";
import classes from "./Parameters.module.css";
import { ParameterTable } from "./ParameterTable";
import { StateLine } from "./StateLine";
import { Toolbar } from "./Toolbar";
import { useSilent } from "./silent";

/** Picks the device of the URL, or the first, and shows its dictionary. */
export function ParametersPage() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const turbine = useQuery(turbineQuery);
  const places = placesOf(turbine.data);
  const place = places.find((one) => one.device.slug === search.device) ?? places[0];
  const description = useQuery({
    ...descriptionQuery(place?.device.description_id ?? ""),
    enabled: place !== undefined,
  });
  const error = turbine.error ?? description.error;
  return (
    <div className={classes.page}>
      <DevicePicker
        places={places}
        value={place?.device.slug ?? null}
        onPick={(device) => update({ device, edit: undefined })}
      />
      {error && <ProblemAlert error={error} title={t("page.table.not_loaded")} />}
      {place && description.data && (
        <Dictionary key={place.device.slug} place={place} doc={description.data} />
      )}
      {!error && !description.data && (
        <Center h="60%">
          <Loader aria-label={t("page.loading")} />
        </Center>
      )}
    </div>
  );
}

function Dictionary({ place, doc }: { place: Place; doc: DescriptionDoc }) {
  const t = useTexts();
  const { slug, node } = place.device;
  const [search, update] = usePageSearch();
  useWatchDevice(slug);
  const context = useMemo<DeviceContext>(
    () => ({ slug, node, doc, t, lookup: (address) => rawOf(store.cell(slug, address)) }),
    [slug, node, doc, t],
  );
  const all = useMemo(() => rowsOf(doc, t), [doc, t]);
  const [typed, setTyped] = useFilter(search.q ?? "", (q) => update({ q: q === "" ? undefined : q }));
  const deferred = useDeferredValue(typed);
  const found = useMemo(() => filterRows(all, deferred), [all, deferred]);
  const rows = useOnlyChanged(found, search.only === "changed", context);
  const list = (text: string | undefined) => (text ? text.split(",") : []);
  const closed = useMemo(
    () => new Set(deferred === "" ? list(search.closed) : []),
    [search.closed, deferred],
  );
  const hidden = useMemo(
    () => (search.hide === undefined ? HIDDEN_AT_FIRST : list(search.hide)),
    [search.hide],
  );
  const sorting = useMemo(() => sortingOf(search.sort), [search.sort]);
  const visible = useRef<{ rows: ParameterRow[]; columns: Column[] }>({ rows: [], columns: [] });
  const onLines = useCallback((shownRows: ParameterRow[], columns: Column[]) => {
    visible.current = { rows: shownRows, columns };
  }, []);
  const onOpen = useCallback((edit: string) => update({ edit }), [update]);
  const toggleGroup = (id: string, open = closed.has(id)) => {
    const next = new Set(closed);
    if (open) next.delete(id);
    else next.add(id);
    update({ closed: next.size === 0 ? undefined : [...next].join() });
  };
  const edited = all.find((row) => row.entry.address === search.edit);
  return (
    <DeviceContextOfTable value={context}>
      <Toolbar filter={typed} onFilter={setTyped} hidden={hidden} visible={visible} entries={doc.entries} />
      <StateLine slug={slug} />
      <ParameterTable
        rows={rows}
        silent={useSilent(slug)}
        sorting={sorting}
        hidden={hidden}
        closed={closed}
        onSort={(sort) => update({ sort: sort[0] ? `${sort[0].desc ? "-" : ""}${sort[0].id}` : undefined })}
        onToggleGroup={toggleGroup}
        onOpen={onOpen}
        onLines={onLines}
      />
      <p className={classes.legend}>
        <strong role="status" data-testid="count">
          {t("page.table.count", { shown: rows.length, total: all.length })}
        </strong>
        <span>{t("page.table.legend")}</span>
      </p>
      {edited && (
        <EntryDialog key={edited.entry.address} row={edited} onClose={() => update({ edit: undefined })} />
      )}
    </DeviceContextOfTable>
  );
}

function sortingOf(sort: string | undefined): SortingState {
  if (!sort) return [];
  return sort.startsWith("-") ? [{ id: sort.slice(1), desc: true }] : [{ id: sort, desc: false }];
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

function useOnlyChanged(rows: readonly ParameterRow[], wanted: boolean, context: DeviceContext) {
  const version = useDeviceVersion(context.slug);
  const relevant = wanted ? version : 0;
  return useMemo(
    () =>
      wanted
        ? rows.filter(({ entry }) =>
            differsFromDefault(entry, store.cell(context.slug, entry.address), context.node),
          )
        : rows,
    // The store is read afresh whenever values of the device came.
    // eslint-disable-next-line react-hooks/exhaustive-deps
    [rows, wanted, context, relevant],
  );
}
