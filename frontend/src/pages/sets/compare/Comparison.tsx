import { Button, Loader } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { type ReactNode, useMemo, useRef } from "react";
import { compareQuery, LEAST_COLUMNS } from "../../../api/compare";
import { usePageSearch } from "../../../frame/search";
import { useHearing } from "../../../live/live";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { type Compared, useCompared } from "./compared";
import classes from "./Compare.module.css";
import { CompareHead } from "./CompareHead";
import { type CompareTableHandle, ComparisonTable } from "./ComparisonTable";
import { useExport } from "./export";
import { Legend } from "./Legend";
import { linesOf } from "./lines";
import type { Against } from "./marks";
import { isLive } from "./specs";
import { Toolbar } from "./Toolbar";
import { Unread } from "./Unread";
import { usePendingOf } from "./usePending";
import { type TableView, useRowActions, useView } from "./view";

interface Props {
  label: string;
  /** Two or more. */
  columns: readonly string[];
  against: Against;
  /** Absent where the columns stay as they are. */
  onColumns?: (columns: string[]) => void;
  /** What chooses the columns; `kind` is that of the first. */
  chooser: (kind: string | null) => ReactNode;
  /** What it comes to. */
  verdict: (compared: Compared) => ReactNode;
  /** In place of the table where there is none. */
  instead?: ReactNode;
}

/** Columns side by side: what it comes to, the tools, and the rows. Columns that change are followed. */
export function Comparison(props: Props) {
  const { columns, against, onColumns, chooser } = props;
  const t = useTexts();
  const hearing = useHearing().state === "hearing";
  const pending = usePendingOf(columns);
  const query = useQuery(compareQuery(columns, pending, hearing && columns.some(isLive)));
  const compared = useCompared(columns.length >= LEAST_COLUMNS ? query.data : undefined);
  const view = useView();
  const exporting = useExport(columns, pending, view.rows);
  if (columns.length < LEAST_COLUMNS || query.isError)
    return (
      <div className={classes.room}>
        <div className={classes.toolbar}>{chooser(null)}</div>
        {query.isError && <ProblemAlert error={query.error} title={t("page.compare.failed")} />}
        {props.instead}
      </div>
    );
  if (!compared)
    return (
      <div className={classes.room}>
        <Loader aria-label={t("page.loading")} />
      </div>
    );
  return (
    <div className={classes.room} aria-busy={query.isPlaceholderData}>
      <div className={classes.verdict}>{props.verdict(compared)}</div>
      <Shown
        label={props.label}
        compared={compared}
        view={view}
        against={against}
        chooser={chooser(compared.doc.columns[0]?.description_id ?? null)}
        onExport={exporting}
        {...(onColumns && { onColumns })}
      />
    </div>
  );
}

interface ShownProps extends Pick<Props, "label" | "against" | "onColumns"> {
  compared: Compared;
  view: TableView;
  chooser: ReactNode;
  onExport: ReturnType<typeof useExport>;
}

function Shown({ label, compared, view, against, chooser, onColumns, onExport }: ShownProps) {
  const actions = useRowActions();
  const table = useRef<CompareTableHandle>(null);
  const lines = useMemo(() => linesOf(compared.rows, { ...view, groups: compared.groups }), [compared, view]);
  const shown = lines.reduce((sum, line) => sum + (line.kind === "section" ? line.count : 0), 0);
  const pickable = compared.doc.columns.some((one) => one.record !== null);
  const narrowed = view.filter !== "" || view.group !== undefined;
  return (
    <>
      <Toolbar
        compared={compared}
        shown={shown}
        picked={[...view.picked]}
        first={chooser}
        typed={view.typed}
        onTyped={view.onTyped}
        onExport={onExport}
        onEnter={() => table.current?.focus()}
      />
      <Unread compared={compared} />
      <ComparisonTable
        label={label}
        compared={compared}
        lines={lines}
        against={against}
        actions={actions}
        picked={pickable ? view.picked : null}
        head={<CompareHead compared={compared} against={against} {...(onColumns && { onColumns })} />}
        empty={<Empty total={compared.rows.length} narrowed={narrowed} onTyped={view.onTyped} />}
        handle={table}
      />
      <Legend pickable={pickable} />
    </>
  );
}

interface EmptyProps {
  total: number;
  narrowed: boolean;
  onTyped: (text: string) => void;
}

function Empty({ total, narrowed, onTyped }: EmptyProps) {
  const t = useTexts();
  const [, update] = usePageSearch();
  if (!narrowed)
    return <>{t(total === 0 ? "page.compare.no_rows" : "page.compare.all_equal", { count: total })}</>;
  const clear = () => {
    onTyped("");
    update({ find: undefined, group: undefined });
  };
  return (
    <>
      {t("page.files.none_match")}{" "}
      <Button variant="default" ml="sm" onClick={clear} data-testid="clear-filters">
        {t("page.compare.clear_filters")}
      </Button>
    </>
  );
}
