/** The columns of the library's table. */
import { Checkbox } from "@mantine/core";
import { IconAlertTriangle, IconCircleCheck } from "@tabler/icons-react";
import type { SetRecord } from "../../../api/types";
import type { Translate } from "../../../texts/texts";
import { useTexts } from "../../../texts/texts";
import type { TableColumn } from "../../../ui/DataTable";
import room from "../../../ui/Room.module.css";
import { dateAndTime } from "../../../ui/format";
import { TagChips, tagKey } from "./TagChips";

export const HIDDEN_FIRST = ["description", "hash", "person", "source", "order", "values"];
const HASH_SHOWN = 12;

/** `blade-1 / pmc` of `wtg-07/blade-1/pmc`. */
export const placeOf = (slug: string) => slug.split("/").slice(1).join(" / ");

export const nameOf = (record: SetRecord) =>
  `${record.origin.turbine} ${placeOf(record.origin.device)} ${dateAndTime(record.t_ns / 1e6)}`;

/** The serial number that the device tells, else that on its plate. */
export const serialOf = ({ identity }: SetRecord) =>
  identity.serial ? String(identity.serial) : (identity.drive_serial ?? identity.nameplate ?? "");

export function Completeness({ record }: { record: SetRecord }) {
  const t = useTexts();
  const complete = record.unread === 0;
  const Icon = complete ? IconCircleCheck : IconAlertTriangle;
  return (
    <span className={`${room.state} ${complete ? "" : "tone-warning"}`}>
      <Icon size={15} aria-hidden />
      {t(`page.sets.state.${complete ? "complete" : "incomplete"}`, { count: record.unread })}
    </span>
  );
}

export function columnsOf(
  t: Translate,
  picked: readonly string[],
  onPick: (id: string) => void,
): TableColumn<SetRecord>[] {
  const column = (
    id: string,
    width: string,
    text: (record: SetRecord) => string,
    more: Partial<TableColumn<SetRecord>> = {},
  ): TableColumn<SetRecord> => ({
    id,
    title: t(`page.sets.column.${id}`),
    width,
    text: (record) => text(record) || "–",
    ...more,
  });
  return [
    {
      id: "pick",
      title: "",
      width: "40px",
      fixed: true,
      text: () => "",
      cell: (record) => <Pick record={record} picked={picked} onPick={onPick} />,
    },
    column("made", "142px", (one) => dateAndTime(one.t_ns / 1e6), { fixed: true, by: (one) => one.t_ns }),
    column("turbine", "minmax(80px, 0.5fr)", (one) => one.origin.turbine),
    column("device", "minmax(110px, 0.7fr)", (one) => placeOf(one.origin.device), { fixed: true }),
    column("tags", "minmax(150px, 1fr)", (one) => one.tags.map(({ tag }) => t(tagKey(tag))).join(", "), {
      cell: (one) => <TagChips tags={one.tags} />,
    }),
    column(
      "state",
      "126px",
      (one) =>
        t(one.unread ? "page.sets.state.incomplete" : "page.sets.state.complete", { count: one.unread }),
      {
        by: (one) => one.unread,
        cell: (one) => <Completeness record={one} />,
      },
    ),
    column("serial", "minmax(80px, 0.5fr)", serialOf),
    column("reason", "minmax(110px, 1.2fr)", (one) => one.origin.reason),
    column("order", "minmax(90px, 0.6fr)", (one) => one.origin.work_order),
    column("person", "minmax(80px, 0.6fr)", (one) => one.origin.person),
    column("source", "110px", (one) => t(`page.sets.source.${one.source}`)),
    column("values", "70px", (one) => String(one.values), { numeric: true, by: (one) => one.values }),
    column(
      "description",
      "minmax(110px, 0.7fr)",
      (one) => `${one.description_id} ${one.description_version}`,
    ),
    column("hash", "120px", (one) => one.hash.slice(0, HASH_SHOWN)),
  ];
}

interface PickProps {
  record: SetRecord;
  picked: readonly string[];
  onPick: (id: string) => void;
}

function Pick({ record, picked, onPick }: PickProps) {
  const t = useTexts();
  return (
    <Checkbox
      aria-label={t("page.sets.pick", { name: nameOf(record) })}
      checked={picked.includes(record.id)}
      onChange={() => onPick(record.id)}
      onClick={(event) => event.stopPropagation()}
      data-testid={`pick-${record.id}`}
    />
  );
}
