import { useMemo } from "react";
import { type BusIdentifier, useIdentifiers } from "../../api/trace";
import { usePageSearch } from "../../frame/search";
import { useServerNow } from "../../live/live";
import { figure } from "../../model/values";
import { useTexts } from "../../texts/texts";
import { DataTable, type TableColumn } from "../../ui/DataTable";
import { useDeviceName } from "../../ui/devices";
import { age } from "../../ui/format";
import classes from "./Bus.module.css";
import { NO_VIEW } from "./filter";
import { bytesOf, idText, serviceText } from "./lines";
import { Share } from "./Share";

const NOW_MS = 500;
const GLOW_MS = 700;

/** One row an identifier: what it carried last, how often it comes, and its share of the bus. */
export function IdentifierTable() {
  const t = useTexts();
  const [, update] = usePageSearch();
  const nameOf = useDeviceName();
  const rows = useIdentifiers();
  const nowMs = useServerNow(NOW_MS);
  const most = Math.max(...rows.map((row) => row.load), 0.001);
  const columns = useMemo((): TableColumn<BusIdentifier>[] => {
    const ms = (period: number | null) => (period === null ? "–" : `${figure(period, 1, t.language)} ms`);
    return [
      { id: "id", title: t("trace.column.id"), width: "70px", text: idText, by: (row) => row.can_id },
      {
        id: "node",
        title: t("trace.column.node"),
        width: "minmax(110px, 1fr)",
        text: (row) => [row.node || "", row.device === null ? "" : nameOf(row.device)].join(" "),
        by: (row) => row.node,
      },
      { id: "service", title: t("trace.column.service"), width: "96px", text: (row) => serviceText(row, t) },
      {
        id: "data",
        title: t("trace.column.data"),
        width: "190px",
        text: (row) => bytesOf(row.data).join(" "),
        cell: (row) => <b className={classes.bytes}>{bytesOf(row.data).join(" ")}</b>,
      },
      {
        id: "last",
        title: t("trace.column.last"),
        width: "70px",
        numeric: true,
        text: (row) => age(nowMs - row.t_ns / 1e6, t.language),
        by: (row) => -row.t_ns,
      },
      {
        id: "count",
        title: t("trace.column.count"),
        width: "84px",
        numeric: true,
        text: (row) => String(row.frames),
        by: (row) => row.frames,
      },
      {
        id: "rate",
        title: t("trace.column.rate"),
        width: "64px",
        numeric: true,
        text: (row) => `${String(row.per_second)}/s`,
        by: (row) => row.per_second,
      },
      {
        id: "period",
        title: t("trace.column.period"),
        width: "84px",
        numeric: true,
        text: (row) => ms(row.period_ms),
        by: (row) => row.period_ms,
      },
      {
        id: "range",
        title: t("trace.column.range"),
        width: "150px",
        text: (row) => (row.shortest_ms === null ? "–" : `${ms(row.shortest_ms)} – ${ms(row.longest_ms)}`),
      },
      {
        id: "share",
        title: t("trace.column.share"),
        width: "minmax(110px, 150px)",
        text: (row) => `${figure(row.load * 100, 2, t.language)} %`,
        by: (row) => row.load,
        cell: (row) => (
          <Share share={row.load} most={most} text={`${figure(row.load * 100, 2, t.language)} %`} />
        ),
      },
    ];
  }, [t, nameOf, nowMs, most]);
  return (
    <DataTable
      label={t("trace.tab.ids")}
      name="ids"
      fileName="bus-ids"
      empty={t("trace.table.none")}
      dense
      live
      rows={rows}
      columns={columns}
      idOf={(row) => `${row.bus}-${idText(row)}`}
      toneOf={(row) => (nowMs - row.t_ns / 1e6 < GLOW_MS ? "fresh" : "plain")}
      onOpen={(row) => update({ tab: undefined, q: undefined, ...NO_VIEW, ids: idText(row) })}
    />
  );
}
