import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { emergenciesQuery, type EmcyLine } from "../../api/trace";
import { usePageSearch } from "../../frame/search";
import { useTexts } from "../../texts/texts";
import { useDeviceName } from "../../ui/devices";
import { timeOfDay } from "../../ui/format";
import { type DataColumn, DataTable } from "./DataTable";
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
  const rows = useQuery(emergenciesQuery).data ?? [];
  const columns = useMemo(
    (): DataColumn<EmcyLine>[] => [
      { id: "time", width: "110px", text: (row) => timeOfDay(row.t_ns / 1e6), order: (row) => row.t_ns },
      {
        id: "node",
        width: "minmax(130px, 1fr)",
        text: (row) => `${String(row.node)} ${row.device === null ? "" : nameOf(row.device)}`,
        order: (row) => row.node,
      },
      {
        id: "code",
        width: "84px",
        text: (row) => detail(row, "code_hex"),
        show: (row) => <b>{detail(row, "code_hex")}</b>,
      },
      { id: "text", width: "minmax(200px, 3fr)", text: (row) => t(detail(row, "reason_key")) },
      { id: "register", width: "84px", text: (row) => detail(row, "register_hex") },
      { id: "data", width: "150px", text: (row) => detail(row, "data") },
    ],
    [t, nameOf],
  );
  return (
    <DataTable
      name="emcy"
      rows={rows}
      columns={columns}
      keyOf={(row) => `${row.bus}-${String(row.t_ns)}`}
      tone={(row) => (row.reset ? "plain" : "error")}
      onOpen={(row) => update({ ...TO_TRACE, frame: BigInt(row.t_ns).toString() })}
    />
  );
}
