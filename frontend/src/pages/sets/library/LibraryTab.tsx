import { ActionIcon } from "@mantine/core";
import {
  IconAlertTriangle,
  IconCircleCheck,
  IconDownload,
  IconFileAlert,
  IconHourglass,
} from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { setDownload, setsQuery } from "../../../api/files";
import type { SetRef } from "../../../api/types";
import { usePageSearch } from "../../../frame/search";
import { type Translate, useTexts } from "../../../texts/texts";
import { DataTable, type TableColumn } from "../../../ui/DataTable";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import room from "../../../ui/Room.module.css";
import { dayAndTime } from "../../../ui/format";
import { BackUp } from "./BackUp";
import { SetDetails } from "./SetDetails";

/** Parameter sets in the data folder, a backup of the turbine, and one set opened below. */
export function LibraryTab() {
  const t = useTexts();
  const list = useQuery(setsQuery);
  const [search, update] = usePageSearch();
  const columns = useMemo(() => columnsOf(t), [t]);
  const files = useMemo(() => list.data?.files.toSorted((a, b) => madeMs(b) - madeMs(a)) ?? [], [list.data]);
  const opened = files.find((file) => file.name === search.file);
  return (
    <div className={room.room}>
      <div className={room.strip}>
        <h1>{t("page.sets.tab.library")}</h1>
        <BackUp />
        <span className={room.spacer} />
        {list.data && (
          <div className={room.facts}>
            <span className={`${room.path} dim`}>{list.data.folder}</span>
          </div>
        )}
      </div>
      {list.isError && <ProblemAlert error={list.error} title={t("page.sets.failed")} />}
      <DataTable
        label={t("page.rooms.sets")}
        rows={files}
        columns={columns}
        idOf={(file) => file.name}
        fileName="hubside-sets"
        empty={t(list.isPending ? "page.loading" : "page.sets.none")}
        onOpen={(file) => update({ file: file.name })}
        selected={search.file}
        hiddenFirst={HIDDEN_FIRST}
      />
      {opened && <SetDetails key={opened.name} file={opened} />}
      {search.file !== undefined && list.isSuccess && !opened && (
        <p className={room.note}>{t("page.sets.gone", { name: search.file })}</p>
      )}
    </div>
  );
}

/** When the set was made, as it says itself; a copied file is not a new set. */
function madeMs(file: SetRef): number {
  const made = Date.parse(file.head?.origin.time ?? "");
  return Number.isNaN(made) ? file.modified_ns / 1e6 : made;
}

export enum SetState {
  Complete = "complete",
  Incomplete = "incomplete",
  Unusable = "unusable",
  Unread = "unread",
}

export function stateOf(file: SetRef): SetState {
  if (file.reason !== null) return SetState.Unusable;
  if (file.head === null) return SetState.Unread;
  return file.head.unread === 0 ? SetState.Complete : SetState.Incomplete;
}

const LOOKS = {
  [SetState.Complete]: { Icon: IconCircleCheck, tone: "" },
  [SetState.Incomplete]: { Icon: IconAlertTriangle, tone: "tone-warning" },
  [SetState.Unusable]: { Icon: IconFileAlert, tone: "tone-error" },
  [SetState.Unread]: { Icon: IconHourglass, tone: "dim" },
};

export function SetStateText({ file }: { file: SetRef }) {
  const t = useTexts();
  const state = stateOf(file);
  const { Icon, tone } = LOOKS[state];
  return (
    <span className={`${room.state} ${tone}`}>
      <Icon size={15} aria-hidden />
      {t(`page.sets.state.${state}`, { count: file.head?.unread ?? 0 })}
    </span>
  );
}

/** `blade-1 / pmc` of `wtg-07/blade-1/pmc`. */
const placeOf = (slug: string) => slug.split("/").slice(1).join(" / ");

const HIDDEN_FIRST = ["description", "hash", "file", "person"];
const HASH_SHOWN = 12;

function columnsOf(t: Translate): TableColumn<SetRef>[] {
  const column = (
    id: string,
    width: string,
    text: (file: SetRef) => string | undefined,
    more: Partial<TableColumn<SetRef>> = {},
  ): TableColumn<SetRef> => ({
    id,
    title: t(`page.sets.column.${id}`),
    width,
    text: (file) => text(file) || "–", // eslint-disable-line @typescript-eslint/prefer-nullish-coalescing -- an empty text is none
    ...more,
  });
  return [
    column(
      "state",
      "minmax(128px, 0.9fr)",
      (file) => t(`page.sets.state.${stateOf(file)}`, { count: file.head?.unread ?? 0 }),
      {
        fixed: true,
        cell: (file) => <SetStateText file={file} />,
      },
    ),
    column("made", "minmax(152px, 1fr)", (file) => dayAndTime(madeMs(file)), { fixed: true, by: madeMs }),
    column("turbine", "minmax(70px, 0.6fr)", (file) => file.head?.origin.turbine.toUpperCase()),
    column("device", "minmax(110px, 0.8fr)", (file) => placeOf(file.head?.origin.device ?? file.name), {
      fixed: true,
    }),
    column("values", "70px", (file) => file.head?.values.toString(), {
      numeric: true,
      by: (file) => file.head?.values ?? null,
    }),
    column("serial", "minmax(80px, 0.6fr)", (file) => file.head?.identity.serial?.toString(), {
      by: (file) => file.head?.identity.serial ?? null,
    }),
    column("reason", "minmax(100px, 1.4fr)", (file) => file.head?.origin.reason),
    column("person", "minmax(80px, 0.7fr)", (file) => file.head?.origin.person),
    column("description", "minmax(110px, 0.7fr)", (file) =>
      file.head ? `${file.head.description_id} ${file.head.description_version}` : undefined,
    ),
    column("hash", "120px", (file) => file.head?.hash.slice(0, HASH_SHOWN)),
    column("file", "minmax(160px, 1.6fr)", (file) => file.name),
    {
      id: "download",
      title: "",
      width: "44px",
      fixed: true,
      text: () => "",
      cell: (file) => <Download file={file} />,
    },
  ];
}

function Download({ file }: { file: SetRef }) {
  const t = useTexts();
  const label = t("page.recordings.download", { name: file.name });
  return (
    <ActionIcon
      component="a"
      href={setDownload(file.name)}
      download
      variant="subtle"
      aria-label={label}
      title={label}
      onClick={(event: React.MouseEvent) => event.stopPropagation()}
    >
      <IconDownload size={17} aria-hidden />
    </ActionIcon>
  );
}
