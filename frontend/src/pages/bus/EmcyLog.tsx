import { useMemo } from "react";
import { type EmcyLine, useEmergencies } from "../../api/trace";
import { usePageSearch } from "../../frame/search";
import { useTexts } from "../../texts/texts";
import { DataTable, type TableColumn } from "../../ui/DataTable";
import { useDeviceName } from "../../ui/devices";
import { timeOfDay } from "../../ui/format";
import { TO_TRACE } from "./SdoLog";

const detail = (row: EmcyLine, name: string): string => {
  const text = row.details[name];
  return typeof text === "string" ? text : "–";
};

/** Emergency messages in the words of the device. */
export function EmcyLog() {
  const t = useTexts();
  const [, update] = usePageSearch();
  const nameOf = useDeviceName();
  const rows = useEmergencies();
  const columns = useMemo(
    (): TableColumn<EmcyLine>[] => [
      {
        id: "time",
        title: t("trace.column.time"),
        width: "110px",
        text: (row) => timeOfDay(row.t_ns / 1e6),
        by: (row) => row.t_ns,
      },
      {
        id: "node",
        title: t("trace.column.node"),
        width: "minmax(130px, 1fr)",
        text: (row) => `${String(row.node)} ${row.device === null ? "" : nameOf(row.device)}`,
        by: (row) => row.node,
      },
      {
        id: "code",
        title: t("trace.column.code"),
        width: "84px",
        text: (row) => detail(row, "code_hex"),
        cell: (row) => <b>{detail(row, "code_hex")}</b>,
      },
      {
        id: "text",
        title: t("trace.column.text"),
        width: "minmax(200px, 3fr)",
        text: (row) => t(detail(row, "reason_key")),
      },
      {
        id: "register",
        title: t("trace.column.register"),
        width: "84px",
        text: (row) => detail(row, "register_hex"),
      },
      { id: "data", title: t("trace.column.data"), width: "150px", text: (row) => detail(row, "data") },
    ],
    [t, nameOf],
  );
  return (
    <DataTable
      label={t("trace.tab.emcy")}
      name="emcy"
      fileName="bus-emcy"
      empty={t("trace.table.none")}
      dense
      rows={rows}
      columns={columns}
      idOf={(row) => `${row.bus}-${String(row.t_ns)}`}
      toneOf={(row) => (row.reset ? "plain" : "error")}
      onOpen={(row) => update({ ...TO_TRACE, frame: BigInt(row.t_ns).toString() })}
    />
  );
}
