import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { type BusIdentifier, identifiersQuery } from "../../api/trace";
import { usePageSearch } from "../../frame/search";
import { useServerNow } from "../../live/live";
import { figure } from "../../model/values";
import { useTexts } from "../../texts/texts";
import { useDeviceName } from "../../ui/devices";
import { age } from "../../ui/format";
import classes from "./Bus.module.css";
import { type DataColumn, DataTable } from "./DataTable";
import { bytesOf, idText, serviceText } from "./lines";
import { Share } from "./Share";

const NOW_MS = 500;
const GLOW_MS = 700;

/** One row an identifier: what it carried last, how often it comes, and its share of the bus. */
export function IdentifierTable() {
  const t = useTexts();
  const [, update] = usePageSearch();
  const nameOf = useDeviceName();
  const rows = useQuery(identifiersQuery).data ?? [];
  const nowMs = useServerNow(NOW_MS);
  const most = Math.max(...rows.map((row) => row.load), 0.001);
  const columns = useMemo((): DataColumn<BusIdentifier>[] => {
    const ms = (period: number | null) => (period === null ? "–" : `${figure(period, 1, t.language)} ms`);
    return [
      { id: "id", width: "70px", text: idText, order: (row) => row.can_id },
      {
        id: "node",
        width: "minmax(110px, 1fr)",
        text: (row) => [row.node || "", row.device === null ? "" : nameOf(row.device)].join(" "),
        order: (row) => row.node,
      },
      { id: "service", width: "96px", text: (row) => serviceText(row, t) },
      {
        id: "data",
        width: "190px",
        text: (row) => bytesOf(row.data).join(" "),
        show: (row) => <b className={classes.bytes}>{bytesOf(row.data).join(" ")}</b>,
      },
      {
        id: "last",
        width: "70px",
        text: (row) => age(nowMs - row.t_ns / 1e6, t.language),
        order: (row) => -row.t_ns,
      },
      { id: "count", width: "84px", text: (row) => String(row.frames), order: (row) => row.frames },
      {
        id: "rate",
        width: "64px",
        text: (row) => `${String(row.per_second)}/s`,
        order: (row) => row.per_second,
      },
      {
        id: "period",
        width: "84px",
        text: (row) => ms(row.period_ms),
        order: (row) => row.period_ms ?? Infinity,
      },
      {
        id: "range",
        width: "150px",
        text: (row) => (row.shortest_ms === null ? "–" : `${ms(row.shortest_ms)} – ${ms(row.longest_ms)}`),
      },
      {
        id: "share",
        width: "minmax(110px, 150px)",
        text: (row) => `${figure(row.load * 100, 2, t.language)} %`,
        order: (row) => row.load,
        show: (row) => (
          <Share share={row.load} most={most} text={`${figure(row.load * 100, 2, t.language)} %`} />
        ),
      },
    ];
  }, [t, nameOf, nowMs, most]);
  return (
    <DataTable
      name="ids"
      rows={rows}
      columns={columns}
      keyOf={(row) => `${row.bus}-${idText(row)}`}
      tone={(row) => (nowMs - row.t_ns / 1e6 < GLOW_MS ? "fresh" : "plain")}
      onOpen={(row) => update({ tab: undefined, q: undefined, sort: undefined, ids: idText(row) })}
    />
  );
}
