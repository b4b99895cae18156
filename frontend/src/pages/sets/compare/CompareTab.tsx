import { Button, CloseButton, Loader } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useMemo, useRef } from "react";
import { compareQuery, LEAST_COLUMNS } from "../../../api/compare";
import { usePageSearch } from "../../../frame/search";
import { useHearing } from "../../../live/live";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { ColumnPicker } from "./ColumnPicker";
import { useCompared } from "./compared";
import classes from "./Compare.module.css";
import { CompareHead } from "./CompareHead";
import { type CompareTableHandle, ComparisonTable } from "./ComparisonTable";
import { useExport } from "./export";
import { Legend } from "./Legend";
import { linesOf } from "./lines";
import { Against } from "./marks";
import { columnsIn, columnsText, isLive } from "./specs";
import { Start } from "./Start";
import { useSpecTitle } from "./titles";
import { Toolbar } from "./Toolbar";
import { Unread } from "./Unread";
import { usePendingOf } from "./usePending";
import { useRowActions, useView } from "./view";
import { Verdict } from "./Verdict";

/** Any two or more states of devices side by side: what differs, and whether it matters. */
export function CompareTab() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const columns = useMemo(() => columnsIn(search.columns), [search.columns]);
  const hearing = useHearing().state === "hearing";
  const pending = usePendingOf(columns);
  const query = useQuery(compareQuery(columns, pending, false, hearing && columns.some(isLive)));
  const doc = columns.length >= LEAST_COLUMNS ? query.data : undefined;
  const compared = useCompared(doc);
  const view = useView();
  const actions = useRowActions();
  const table = useRef<CompareTableHandle>(null);
  const lines = useMemo(
    () => (compared ? linesOf(compared.rows, { ...view, groups: compared.groups }) : []),
    [compared, view],
  );
  const shown = lines.filter((line) => line.kind === "row").length;
  const exporting = useExport(columns, pending);
  const onColumns = (next: string[]) => update({ columns: columnsText(next) });
  const picker = (
    <ColumnPicker columns={columns} kind={doc?.columns[0]?.description_id ?? null} onColumns={onColumns} />
  );
  if (columns.length < LEAST_COLUMNS || query.isError)
    return (
      <div className={classes.room}>
        <div className={classes.toolbar}>
          {picker}
          <Columns columns={columns} onColumns={onColumns} />
        </div>
        {query.isError && <ProblemAlert error={query.error} title={t("page.compare.failed")} />}
        {columns.length < LEAST_COLUMNS && <Start columns={columns} onColumns={onColumns} />}
      </div>
    );
  if (!compared)
    return (
      <div className={classes.room}>
        <Loader aria-label={t("page.loading")} />
      </div>
    );
  const pickable = compared.doc.columns.some((one) => one.record !== null);
  return (
    <div className={classes.room} aria-busy={query.isPlaceholderData}>
      <Verdict summary={compared.doc.summary} />
      <Toolbar
        compared={compared}
        shown={shown}
        picked={[...view.picked]}
        first={picker}
        typed={view.typed}
        onTyped={view.onTyped}
        onExport={exporting}
        onEnter={() => table.current?.focus()}
      />
      <Unread compared={compared} />
      <ComparisonTable
        label={t("page.sets.tab.compare")}
        compared={compared}
        lines={lines}
        against={Against.Reference}
        actions={actions}
        picked={pickable ? view.picked : null}
        head={<CompareHead compared={compared} against={Against.Reference} onColumns={onColumns} />}
        empty={
          <Empty total={compared.rows.length} filtered={view.filter !== "" || view.group !== undefined} />
        }
        handle={table}
      />
      <Legend />
    </div>
  );
}

/** What is chosen, while it cannot be shown as a table. */
function Columns({
  columns,
  onColumns,
}: {
  columns: readonly string[];
  onColumns: (columns: string[]) => void;
}) {
  const t = useTexts();
  const titleOf = useSpecTitle();
  return (
    <ul className={classes.chosen} aria-label={t("page.compare.chosen")}>
      {columns.map((column) => (
        <li key={column}>
          {titleOf(column)}
          <CloseButton
            aria-label={t("page.compare.take_out", { column: titleOf(column) })}
            onClick={() => onColumns(columns.filter((one) => one !== column))}
          />
        </li>
      ))}
    </ul>
  );
}

function Empty({ total, filtered }: { total: number; filtered: boolean }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  if (filtered)
    return (
      <>
        {t("page.files.none_match")}{" "}
        <Button variant="default" ml="sm" onClick={() => update({ find: undefined, group: undefined })}>
          {t("page.compare.show_all_found")}
        </Button>
      </>
    );
  return <>{t(total === 0 ? "page.compare.no_rows" : "page.compare.all_equal", { count: total })}</>;
}
