import { useMemo } from "react";
import type { Motor, MotorList as List } from "../../../api/motors";
import { usePageSearch } from "../../../frame/search";
import { localise } from "../../../model/values";
import { type Translate, useTexts } from "../../../texts/texts";
import { DataTable, type TableColumn } from "../../../ui/DataTable";
import { dateAndTime } from "../../../ui/format";
import { InventedChip } from "./chips";
import { devicesOf, placeOf, titleOf } from "./places";

const HIDDEN_FIRST = ["remarks"];

interface Props {
  list: List | undefined;
  pending: boolean;
  /** Something is open beside it. */
  narrow: boolean;
}

export function MotorList({ list, pending, narrow }: Props) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const columns = useMemo(() => columnsOf(t, list, narrow), [t, list, narrow]);
  const { id } = placeOf(search.motor ?? "");
  return (
    <DataTable
      label={t("page.sets.tab.motors")}
      name="motor"
      rows={list?.motors ?? []}
      columns={columns}
      idOf={(motor) => motor.id}
      fileName="hubside-motors-list"
      empty={t(pending ? "page.loading" : "page.sets.empty.motors")}
      onOpen={(motor) => update({ motor: motor.id, columns: undefined })}
      selected={id}
      hiddenFirst={HIDDEN_FIRST}
    />
  );
}

function columnsOf(t: Translate, list: List | undefined, narrow: boolean): TableColumn<Motor>[] {
  const title = (id: string) => t(`page.motors.column.${id}`);
  const number = (found: number | null | undefined, unit: string) =>
    found == null ? "–" : `${localise(String(found), t.language)} ${unit}`;
  const devices = (motor: Motor) =>
    list
      ? devicesOf(list, motor.id)
          .map((one) => one.device)
          .join(", ")
      : "";
  const always: TableColumn<Motor>[] = [
    {
      id: "motor",
      title: title("motor"),
      width: narrow ? "minmax(220px, 2fr)" : "minmax(300px, 2fr)",
      fixed: true,
      text: (motor) => (motor.invented ? `${titleOf(motor)} ${t("motor.source.example")}` : titleOf(motor)),
      cell: (motor) => (
        <>
          {motor.type} <span className="dim">{motor.invented ? "" : motor.maker}</span>{" "}
          <InventedChip motor={motor} />
        </>
      ),
    },
    {
      id: "power",
      title: title("power"),
      width: "82px",
      numeric: true,
      text: (motor) => number(motor.plate.power_kw, "kW"),
      by: (motor) => motor.plate.power_kw ?? null,
    },
    {
      id: "speed",
      title: title("speed"),
      width: "104px",
      numeric: true,
      text: (motor) => number(motor.plate.speed_rpm, "1/min"),
      by: (motor) => motor.plate.speed_rpm ?? null,
    },
  ];
  if (narrow) return always;
  return [
    ...always,
    {
      id: "current",
      title: title("current"),
      width: "82px",
      numeric: true,
      text: (motor) => number(motor.plate.current_a, "A"),
      by: (motor) => motor.plate.current_a ?? null,
    },
    {
      id: "version",
      title: title("version"),
      width: "78px",
      numeric: true,
      text: (motor) => String(motor.version),
      by: (motor) => motor.version,
    },
    {
      id: "source",
      title: title("source"),
      width: "minmax(130px, 1.2fr)",
      text: (motor) => originText(motor, t),
    },
    {
      id: "changed",
      title: title("changed"),
      width: "minmax(168px, 1fr)",
      text: (motor) => (motor.invented ? "–" : `${dateAndTime(motor.t_ns / 1e6)} ${motor.person}`),
      by: (motor) => motor.t_ns,
    },
    {
      id: "devices",
      title: title("devices"),
      width: "minmax(150px, 1fr)",
      text: (motor) => devices(motor) || "–",
    },
    {
      id: "remarks",
      title: title("remarks"),
      width: "minmax(100px, 1fr)",
      text: (motor) => motor.remarks || "–",
    },
  ];
}

/** `from a device: wtg-07/blade-1/pmc`. */
export function originText(motor: Motor, t: Translate): string {
  const source = t(`motor.source.${motor.source}`);
  return motor.invented || motor.origin === "" ? source : `${source}: ${motor.origin}`;
}
