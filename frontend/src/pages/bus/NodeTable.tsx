import { IconAlertTriangle } from "@tabler/icons-react";
import { useMemo } from "react";
import { type BusNode, useBusNodes } from "../../api/trace";
import { usePageSearch } from "../../frame/search";
import { useServerNow } from "../../live/live";
import { figure } from "../../model/values";
import { useTexts } from "../../texts/texts";
import { DataTable, type TableColumn } from "../../ui/DataTable";
import { useDeviceName } from "../../ui/devices";
import { age } from "../../ui/format";
import { NO_VIEW } from "./filter";
import { Share } from "./Share";

const NOW_MS = 500;
const LATE_FACTOR = 1.5;

/** Every node that was seen or that the site names: state, heartbeat and its age, load, emergencies, SDO. */
export function NodeTable() {
  const t = useTexts();
  const [, update] = usePageSearch();
  const nameOf = useDeviceName();
  const rows = useBusNodes();
  const nowMs = useServerNow(NOW_MS);
  const most = Math.max(...rows.map((row) => row.load), 0.001);
  const columns = useMemo((): TableColumn<BusNode>[] => {
    const agoOf = (tNs: number) => age(nowMs - tNs / 1e6, t.language);
    const stateOf = (row: BusNode) =>
      !row.seen
        ? t("trace.table.not_seen")
        : row.silent
          ? t("trace.table.silent")
          : !row.managed
            ? t("page.bench.alive")
            : row.nmt === null
              ? "–"
              : t(row.nmt);
    const heartbeatOf = (row: BusNode) => {
      if (!row.managed && row.answered_t_ns !== null)
        return t("page.bench.answered", { age: agoOf(row.answered_t_ns) });
      if (row.heartbeat_t_ns === null) return "–";
      const period =
        row.period_ms === null
          ? ""
          : ` · ${t("trace.table.period", { period: figure(row.period_ms, 0, t.language) })}`;
      return `${agoOf(row.heartbeat_t_ns)}${period}`;
    };
    const late = (row: BusNode) =>
      row.heartbeat_t_ns !== null &&
      row.period_ms !== null &&
      nowMs - row.heartbeat_t_ns / 1e6 > row.period_ms * LATE_FACTOR + NOW_MS;
    const emcyOf = (row: BusNode) =>
      row.emcy === null || row.emcy_t_ns === null
        ? "–"
        : row.emcy.reset === true
          ? `${t("trace.table.reset")} · ${agoOf(row.emcy_t_ns)}`
          : `${t("trace.note.abort", row.emcy)} · ${agoOf(row.emcy_t_ns)}`;
    const sdoOf = (row: BusNode) =>
      [
        t("trace.table.transfers", { count: row.sdo_count }),
        row.other_client_t_ns === null
          ? ""
          : t("trace.table.other_client", { age: agoOf(row.other_client_t_ns) }),
      ]
        .filter(Boolean)
        .join(" · ");
    return [
      {
        id: "node",
        title: t("trace.column.node"),
        width: "62px",
        text: (row) => String(row.node),
        by: (row) => row.node,
      },
      {
        id: "device",
        title: t("trace.column.device"),
        width: "minmax(120px, 1.2fr)",
        text: (row) => (row.device === null ? t("trace.table.foreign") : nameOf(row.device)),
      },
      {
        id: "name",
        title: t("trace.column.name"),
        width: "minmax(110px, 1.3fr)",
        text: (row) => row.device_name ?? "–",
      },
      {
        id: "nmt",
        title: t("trace.column.nmt"),
        width: "140px",
        text: stateOf,
        cell: (row) => (
          <span
            className={
              row.silent || !row.seen ? "tone-error" : row.nmt === "nmt.state.operational" ? "tone-ok" : ""
            }
          >
            {(row.silent || !row.seen) && <IconAlertTriangle size={13} aria-hidden />} {stateOf(row)}
          </span>
        ),
      },
      {
        id: "heartbeat",
        title: t("trace.column.heartbeat"),
        width: "160px",
        text: heartbeatOf,
        by: (row) => -(row.heartbeat_t_ns ?? 0),
        cell: (row) => (
          <span className={late(row) ? "tone-warning" : ""}>
            {heartbeatOf(row)}
            {late(row) && ` · ${t("trace.table.late")}`}
          </span>
        ),
      },
      {
        id: "boots",
        title: t("trace.column.boots"),
        width: "62px",
        text: (row) => String(row.boots),
        by: (row) => row.boots,
      },
      {
        id: "share",
        title: t("trace.column.share"),
        width: "120px",
        text: (row) => `${figure(row.load * 100, 2, t.language)} %`,
        by: (row) => row.load,
        cell: (row) => (
          <Share share={row.load} most={most} text={`${figure(row.load * 100, 2, t.language)} %`} />
        ),
      },
      {
        id: "emcy",
        title: t("trace.column.emcy"),
        width: "minmax(140px, 1.6fr)",
        text: emcyOf,
        by: (row) => -(row.emcy_t_ns ?? 0),
      },
      {
        id: "sdo",
        title: t("trace.column.sdo"),
        width: "minmax(120px, 1fr)",
        text: sdoOf,
        by: (row) => row.sdo_count,
      },
    ];
  }, [t, nameOf, nowMs, most]);
  return (
    <DataTable
      label={t("trace.tab.nodes")}
      name="nodes"
      fileName="bus-nodes"
      empty={t("trace.table.none")}
      dense
      live
      rows={rows}
      columns={columns}
      idOf={(row) => `${row.bus}-${String(row.node)}`}
      toneOf={(row) => (row.silent ? "error" : "plain")}
      onOpen={(row) => update({ tab: undefined, q: undefined, ...NO_VIEW, nodes: String(row.node) })}
    />
  );
}
