import { IconAlertOctagon, IconArrowBackUp, IconCircleCheck, IconLoader2 } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { type RestoreHead, restoresQuery } from "../../../api/restore";
import { usePageSearch } from "../../../frame/search";
import { type Translate, useTexts } from "../../../texts/texts";
import { DataTable, type TableColumn } from "../../../ui/DataTable";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { dayAndTime } from "../../../ui/format";
import { useStationName } from "./names";
import classes from "./Restore.module.css";

const HIDDEN_FIRST = ["turbine", "ended"];

/** All restores, latest first. */
export function History() {
  const t = useTexts();
  const [, update] = usePageSearch();
  const stationName = useStationName();
  const { data, error, isPending } = useQuery(restoresQuery);
  const columns = useMemo(() => columnsOf(t, stationName), [t, stationName]);
  return (
    <div className={classes.main}>
      <h2 className={classes.heading}>{t("page.restoring.history")}</h2>
      {error && <ProblemAlert error={error} title={t("page.restoring.history_failed")} />}
      <DataTable
        label={t("page.restoring.history")}
        name="restore"
        rows={data ?? NONE}
        columns={columns}
        idOf={(one) => one.id}
        fileName="hubside-restores"
        empty={t(isPending ? "page.loading" : "page.restoring.no_history")}
        onOpen={(one) => update({ restore: one.id, sets: undefined, select: undefined, rows: undefined })}
        hiddenFirst={HIDDEN_FIRST}
      />
    </div>
  );
}

const NONE: RestoreHead[] = [];

const LOOKS = {
  new: { Icon: IconCircleCheck, tone: "tone-ok" },
  old: { Icon: IconArrowBackUp, tone: "" },
  "given-up": { Icon: IconAlertOctagon, tone: "tone-warning" },
  incomplete: { Icon: IconAlertOctagon, tone: "tone-error" },
} as const;
const RUNNING = { Icon: IconLoader2, tone: "tone-warning" };

function columnsOf(t: Translate, stationName: (slug: string) => string): TableColumn<RestoreHead>[] {
  const column = (
    id: string,
    width: string,
    text: (one: RestoreHead) => string,
    more: Partial<TableColumn<RestoreHead>> = {},
  ): TableColumn<RestoreHead> => ({
    id,
    title: t(`page.restoring.column.${id}`),
    width,
    text: (one) => text(one) || "–",
    ...more,
  });
  const state = (one: RestoreHead) => t(`restore.state.${one.state}`);
  const time = (ns: number | null) => (ns === null ? "" : dayAndTime(ns / 1e6));
  return [
    column("end", "minmax(150px, 1fr)", state, {
      fixed: true,
      cell: (one) => {
        const { Icon, tone } = one.end === null ? RUNNING : LOOKS[one.end];
        return (
          <span className={`${classes.cell} ${tone}`}>
            <Icon size={16} aria-hidden />
            <span>{state(one)}</span>
          </span>
        );
      },
    }),
    column("started", "156px", (one) => time(one.started_ns), { fixed: true, by: (one) => one.started_ns }),
    column("turbine", "90px", (one) => one.turbine.toUpperCase()),
    column("station", "minmax(80px, 0.6fr)", (one) => stationName(one.station), { fixed: true }),
    column("work_order", "minmax(90px, 0.7fr)", (one) => one.work_order),
    column("reason", "minmax(120px, 1.4fr)", (one) => one.reason),
    column("cause", "minmax(120px, 1.2fr)", (one) => (one.cause_key === null ? "" : t(one.cause_key))),
    column("person", "minmax(90px, 0.7fr)", (one) => one.person),
    column("ended", "156px", (one) => time(one.ended_ns), { by: (one) => one.ended_ns }),
  ];
}
