import { SegmentedControl } from "@mantine/core";
import { keepPreviousData, useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { type SdoLine, transfersQuery } from "../../api/trace";
import { usePageSearch } from "../../frame/search";
import { figure } from "../../model/values";
import { useTexts } from "../../texts/texts";
import { useDeviceName } from "../../ui/devices";
import { timeOfDay } from "../../ui/format";
import { type DataColumn, DataTable } from "./DataTable";
import { objectName, valueText } from "./lines";

const CHOICES = ["writes", "failed", "all"];

/** SDO transfers: who did what to which object, with which value and result. */
export function SdoLog() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const nameOf = useDeviceName();
  const which = CHOICES.find((one) => one === search.kind) ?? "writes";
  const rows = useQuery({ ...transfersQuery(which), placeholderData: keepPreviousData }).data ?? [];
  const columns = useMemo(
    (): DataColumn<SdoLine>[] => [
      { id: "time", width: "104px", text: (row) => timeOfDay(row.t_ns / 1e6), order: (row) => row.t_ns },
      { id: "who", width: "110px", text: (row) => t(row.ours ? "trace.page.ours" : "trace.page.other") },
      {
        id: "node",
        width: "minmax(110px, 0.8fr)",
        text: (row) => `${String(row.node)} ${row.device === null ? "" : nameOf(row.device)}`,
        order: (row) => row.node,
      },
      { id: "access", width: "82px", text: (row) => t(`trace.table.${row.access}`) },
      {
        id: "address",
        width: "minmax(160px, 1.6fr)",
        text: (row) => `${row.item.address} ${objectName(row.item, t)}`,
        show: (row) => (
          <>
            <code>{row.item.address}</code> {objectName(row.item, t)}
          </>
        ),
      },
      {
        id: "value",
        width: "minmax(90px, 1fr)",
        text: (row) => valueText(row.item, t) || "–",
        show: (row) => <b>{valueText(row.item, t) || "–"}</b>,
      },
      {
        id: "result",
        width: "minmax(110px, 1.4fr)",
        text: (row) =>
          [t(`trace.outcome.${row.outcome}`), row.abort === null ? "" : t("trace.note.abort", row.abort)]
            .filter(Boolean)
            .join(" "),
      },
      {
        id: "took",
        width: "84px",
        text: (row) => `${figure(row.took_ms, 1, t.language)} ms`,
        order: (row) => row.took_ms,
      },
    ],
    [t, nameOf],
  );
  return (
    <DataTable
      name="sdo"
      rows={rows}
      columns={columns}
      keyOf={(row) => `${row.bus}-${String(row.t_ns)}`}
      tone={(row) => (row.outcome === "done" ? "plain" : row.outcome === "lost" ? "warning" : "error")}
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
  sort: undefined,
  kind: undefined,
  nodes: undefined,
  services: undefined,
  ids: undefined,
  data: undefined,
  dir: undefined,
  errors: undefined,
  paused: "1",
} as const;
