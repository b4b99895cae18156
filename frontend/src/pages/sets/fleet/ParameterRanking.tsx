import { useMemo } from "react";
import type { FleetAddress, FleetDoc } from "../../../api/fleet";
import { localise } from "../../../model/values";
import { useTexts } from "../../../texts/texts";
import { DataTable, type TableColumn } from "../../../ui/DataTable";
import type { FleetNames } from "./names";

/** The parameters that differ at the most devices, first. */
export function ParameterRanking({ doc, names }: { doc: FleetDoc; names: FleetNames }) {
  const t = useTexts();
  const columns = useMemo((): TableColumn<FleetAddress>[] => {
    const count = (id: "different" | "missing" | "unit", width: string): TableColumn<FleetAddress> => ({
      id,
      title: t(`page.fleet.devices.${id}`),
      width,
      numeric: true,
      text: (one) => `${one[id]}`,
      by: (one) => one[id],
    });
    return [
      {
        id: "address",
        title: t("page.table.column.address"),
        width: "80px",
        text: (one) => one.address,
        fixed: true,
      },
      {
        id: "name",
        title: t("page.compare.head.parameter"),
        width: "minmax(220px, 2fr)",
        text: (one) => names.parameter(one.address),
        fixed: true,
      },
      {
        id: "group",
        title: t("page.fleet.column.group"),
        width: "minmax(120px, 1fr)",
        text: (one) => names.group(one.group),
      },
      {
        id: "golden",
        title: t("page.compare.source.golden"),
        width: "minmax(100px, 1fr)",
        text: (one) => `${localise(one.golden_shown, t.language)} ${one.golden_unit}`.trim(),
      },
      count("different", "124px"),
      count("missing", "110px"),
      count("unit", "130px"),
      {
        id: "restore",
        title: t("page.entry.restore"),
        width: "minmax(120px, 1fr)",
        text: (one) => t(`page.restore.${one.restore}`),
      },
    ];
  }, [t, names]);
  return (
    <DataTable
      label={t("page.fleet.view.parameters")}
      name="fleet-parameter"
      rows={doc.addresses}
      columns={columns}
      idOf={(one) => one.address}
      fileName="hubside-fleet-parameters"
      empty={t("page.fleet.all_equal")}
    />
  );
}
