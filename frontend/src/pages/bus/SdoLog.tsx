import { SegmentedControl } from "@mantine/core";
import { useMemo } from "react";
import { type SdoLine, useTransfers } from "../../api/trace";
import { usePageSearch } from "../../frame/search";
import { figure } from "../../model/values";
import { useTexts } from "../../texts/texts";
import { DataTable, type TableColumn } from "../../ui/DataTable";
import { useDeviceName } from "../../ui/devices";
import { timeOfDay } from "../../ui/format";
import { NO_VIEW } from "./filter";
import { objectName, valueText } from "./lines";

const CHOICES = ["writes", "failed", "all"];

/** SDO transfers: who did what to which object, with which value and result. */
export function SdoLog() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const nameOf = useDeviceName();
  const which = CHOICES.find((one) => one === search.kind) ?? "writes";
  const rows = useTransfers(which).data ?? [];
  const columns = useMemo(
    (): TableColumn<SdoLine>[] => [
      {
        id: "time",
        title: t("trace.column.time"),
        width: "104px",
        text: (row) => timeOfDay(row.t_ns / 1e6),
        by: (row) => row.t_ns,
      },
      {
        id: "who",
        title: t("trace.column.who"),
        width: "110px",
        text: (row) => t(row.ours ? "trace.page.ours" : "trace.page.other"),
      },
      {
        id: "node",
        title: t("trace.column.node"),
        width: "minmax(110px, 0.8fr)",
        text: (row) => `${String(row.node)} ${row.device === null ? "" : nameOf(row.device)}`,
        by: (row) => row.node,
      },
      {
        id: "access",
        title: t("trace.column.access"),
        width: "82px",
        text: (row) => t(`trace.table.${row.access}`),
      },
      {
        id: "address",
        title: t("trace.column.address"),
        width: "minmax(160px, 1.6fr)",
        text: (row) => `${row.item.address} ${objectName(row.item, t)}`,
        cell: (row) => (
          <>
            <code>{row.item.address}</code> {objectName(row.item, t)}
          </>
        ),
      },
      {
        id: "value",
        title: t("trace.column.value"),
        width: "minmax(90px, 1fr)",
        text: (row) => valueText(row.item, t) || "–",
        cell: (row) => <b>{valueText(row.item, t) || "–"}</b>,
      },
      {
        id: "result",
        title: t("trace.column.result"),
        width: "minmax(110px, 1.4fr)",
        text: (row) =>
          [t(`trace.outcome.${row.outcome}`), row.abort === null ? "" : t("trace.note.abort", row.abort)]
            .filter(Boolean)
            .join(" "),
      },
      {
        id: "took",
        title: t("trace.column.took"),
        width: "84px",
        numeric: true,
        text: (row) => `${figure(row.took_ms, 1, t.language)} ms`,
        by: (row) => row.took_ms,
      },
    ],
    [t, nameOf],
  );
  return (
    <DataTable
      label={t("trace.tab.sdo")}
      name="sdo"
      fileName="bus-sdo"
      empty={t("trace.table.none")}
      dense
      rows={rows}
      columns={columns}
      idOf={(row) => `${row.bus}-${String(row.t_ns)}`}
      toneOf={(row) => (row.outcome === "done" ? "plain" : row.outcome === "lost" ? "warning" : "error")}
      onOpen={(row) => update({ ...TO_TRACE, frame: BigInt(row.t_ns).toString() })}
      tools={
        <SegmentedControl
          aria-label={t("trace.table.which")}
          data={CHOICES.map((value) => ({ value, label: t(`trace.table.which_${value}`) }))}
          value={which}
          onChange={(to) => update({ kind: to === "writes" ? undefined : to })}
          data-testid="sdo-which"
        />
      }
    />
  );
}

/** Leaves the table for the trace, without the filters of either. */
export const TO_TRACE = {
  tab: undefined,
  q: undefined,
  ...NO_VIEW,
  kind: undefined,
  nodes: undefined,
  services: undefined,
  ids: undefined,
  data: undefined,
  dir: undefined,
  errors: undefined,
  paused: "1",
} as const;
