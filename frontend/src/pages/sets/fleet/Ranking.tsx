import { useMemo } from "react";
import type { FleetDevice, FleetDoc } from "../../../api/fleet";
import { useTexts } from "../../../texts/texts";
import { DataTable, type TableColumn } from "../../../ui/DataTable";
import { dateAndTime } from "../../../ui/format";
import { useFleetDevice } from "./deviceLabel";
import classes from "./Fleet.module.css";
import type { FleetNames } from "./names";
import { useOpenComparison } from "./open";

/** The devices that differ most, first. */
export function Ranking({ doc, names }: { doc: FleetDoc; names: FleetNames }) {
  const t = useTexts();
  const open = useOpenComparison(doc);
  const nameOf = useFleetDevice();
  const most = Math.max(1, ...doc.devices.map((one) => one.different));
  const columns = useMemo(
    (): TableColumn<FleetDevice>[] => [
      {
        id: "device",
        title: t("page.fleet.column.device"),
        width: "minmax(170px, 1.1fr)",
        text: (one) => nameOf(one.device),
        fixed: true,
      },
      {
        id: "different",
        title: t("page.fleet.column.different"),
        width: "minmax(150px, 0.8fr)",
        text: (one) => `${one.different}`,
        by: (one) => one.different,
        fixed: true,
        cell: (one) => <Bar count={one.different} most={most} />,
      },
      {
        id: "missing",
        title: t("page.fleet.column.missing"),
        width: "92px",
        numeric: true,
        text: (one) => `${one.missing}`,
        by: (one) => one.missing,
      },
      {
        id: "unit",
        title: t("page.fleet.column.unit"),
        width: "104px",
        numeric: true,
        text: (one) => `${one.unit}`,
        by: (one) => one.unit,
      },
      {
        id: "top",
        title: t("page.fleet.column.top"),
        width: "minmax(220px, 2.4fr)",
        text: (one) => one.top.map((address) => `${address} ${names.parameter(address)}`).join(", ") || "–",
      },
      {
        id: "taken",
        title: t("page.fleet.column.taken"),
        width: "136px",
        text: (one) => dateAndTime(one.t_ns / 1e6),
        by: (one) => one.t_ns,
      },
    ],
    [t, names, nameOf, most],
  );
  return (
    <DataTable
      label={t("page.fleet.view.ranking")}
      name="fleet"
      rows={doc.devices}
      columns={columns}
      idOf={(one) => one.device}
      fileName="hubside-fleet"
      empty={t("page.fleet.no_devices")}
      onOpen={(one) => open(one)}
    />
  );
}

/** A number with a bar beside it: the length says the same as the number. */
function Bar({ count, most }: { count: number; most: number }) {
  return (
    <span className={classes.bar}>
      <b>{count}</b>
      <i aria-hidden style={{ width: `${(count / most) * 100}%` }} />
    </span>
  );
}
