import { ActionIcon, Button } from "@mantine/core";
import {
  IconAlertTriangle,
  IconCircleCheck,
  IconCircleFilled,
  IconDownload,
  IconFileAlert,
  IconHourglass,
  IconPlayerPlay,
} from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { lazy, Suspense, useMemo } from "react";
import { recordingDownload, recordingsQuery } from "../../api/files";
import type { LinkData, RecordingRef } from "../../api/types";
import { usePageSearch } from "../../frame/search";
import { useLiveLink, useServerNow } from "../../live/live";
import { figure } from "../../model/values";
import { useOpenReplay } from "../../replay/leaving";
import { type Translate, useTexts } from "../../texts/texts";
import { DataTable, type TableColumn } from "../../ui/DataTable";
import { ProblemAlert } from "../../ui/ProblemAlert";
import room from "../../ui/Room.module.css";
import { bytes, clock, dayAndTime } from "../../ui/format";
import { TabbedRoom } from "../../ui/TabbedRoom";
import { ImportRecording } from "./RecordingFilesImport";
import { RecordingDetails } from "./RecordingDetails";

const SECOND_MS = 1000;

const Desk = lazy(async () => ({ default: (await import("./desk/Desk")).Desk }));

/** Each comes when it is looked at. */
const TABS = {
  files: RecordingList,
  incidents: lazy(async () => ({ default: (await import("./incidents/IncidentsTab")).IncidentsTab })),
  search: lazy(async () => ({ default: (await import("./search/SearchTab")).SearchTab })),
  overlay: lazy(async () => ({ default: (await import("./overlay/OverlayTab")).OverlayTab })),
};

/** What belongs to one tab. */
const OWN = [
  "find",
  "order",
  "less",
  "file",
  "q",
  "select",
  "incident",
  "overlay",
  "curves",
  "window",
] as const;

/** The recordings and what is kept and looked for in them; while one is replayed, its desk. */
export function RecordingsPage() {
  const [search] = usePageSearch();
  if (search.replay === undefined) return <Rooms />;
  return (
    <Suspense>
      <Desk />
    </Suspense>
  );
}

function Rooms() {
  const t = useTexts();
  const [search] = usePageSearch();
  return (
    <TabbedRoom
      name="recordings"
      label={t("page.recordings.tab.label")}
      titleOf={(tab) => t(`page.recordings.tab.${tab}`)}
      tabs={TABS}
      usual={search.incident === undefined ? undefined : "incidents"}
      own={OWN}
    />
  );
}

/** The recordings on the disk, the running one first of all; one of them opened below. */
function RecordingList() {
  const t = useTexts();
  const list = useQuery(recordingsQuery);
  const link = useLiveLink();
  const replay = useOpenReplay();
  const [search, update] = usePageSearch();
  const columns = useMemo(() => columnsOf(t, link, replay), [t, link, replay]);
  const files = useMemo(() => latestFirst(list.data?.files ?? [], link), [list.data, link]);
  const opened = files.find((file) => file.name === search.file);
  return (
    <div className={room.room}>
      <div className={room.strip}>
        <h1>{t("page.rooms.recordings")}</h1>
        <Running link={link} />
        <span className={room.spacer} />
        <ImportRecording />
        {list.data && (
          <div className={room.facts} data-testid="recordings-folder">
            <span className={`${room.path} dim`}>{list.data.folder}</span>
            {list.data.free_bytes !== null && (
              <span>{t("page.recordings.free", { free: bytes(list.data.free_bytes, t.language) })}</span>
            )}
          </div>
        )}
      </div>
      {list.isError && <ProblemAlert error={list.error} title={t("page.recordings.failed")} />}
      <DataTable
        label={t("page.rooms.recordings")}
        rows={files}
        columns={columns}
        idOf={(file) => file.name}
        fileName="hubside-recordings"
        empty={t(list.isPending ? "page.loading" : "page.recordings.none")}
        onOpen={(file) => update({ file: file.name })}
        onRun={(file) => notReplayed(file, t) === null && replay(file.name)}
        selected={search.file}
        hiddenFirst={HIDDEN_FIRST}
      />
      {opened && <RecordingDetails file={opened} />}
      {search.file !== undefined && list.isSuccess && !opened && (
        <p className={room.note}>{t("page.recordings.gone", { name: search.file })}</p>
      )}
    </div>
  );
}

/** What the recorder does now, from the bus's own link, not from the list. */
function Running({ link }: { link: LinkData | null }) {
  const t = useTexts();
  const nowMs = useServerNow(SECOND_MS);
  const recording = link?.recording;
  if (!recording) return null;
  const ranMs = recording.since_ns === null ? 0 : nowMs - recording.since_ns / 1e6;
  const on = recording.state === "on";
  return (
    <div className={`${room.facts} bench`} data-testid="running">
      <strong className={on ? "tone-ok" : "tone-warning"}>
        {on ? t("page.recording.running", { clock: clock(ranMs) }) : t(`page.recording.${recording.state}`)}
      </strong>
      <span className={recording.lost > 0 ? "tone-error" : "dim"}>
        {t("page.recordings.running_facts", {
          size: bytes(recording.size_bytes, t.language),
          frames: figure(recording.frames, 0, t.language),
          lost: recording.lost,
        })}
      </span>
    </div>
  );
}

const STATE_LOOKS = {
  live: { Icon: IconCircleFilled, tone: "tone-ok" },
  finished: { Icon: IconCircleCheck, tone: "" },
  unfinished: { Icon: IconAlertTriangle, tone: "tone-warning" },
  unreadable: { Icon: IconFileAlert, tone: "tone-error" },
  unread: { Icon: IconHourglass, tone: "dim" },
};

/** Why a file cannot be replayed, and what helps; null where it can. */
export function notReplayed({ state }: RecordingRef, t: Translate): string | null {
  return state === "live" || state === "unreadable" ? t(`page.recordings.not_replayed.${state}`) : null;
}

interface ReplayButtonProps {
  file: RecordingRef;
  onReplay: (file: string) => void;
  small?: boolean;
}

export function ReplayButton({ file, onReplay, small = false }: ReplayButtonProps) {
  const t = useTexts();
  const reason = notReplayed(file, t);
  const label = t("page.recordings.replay_of", { name: file.name });
  const title = reason === null ? label : t("page.recordings.not_replayable", { reason });
  const open = (event: React.MouseEvent) => {
    event.stopPropagation();
    onReplay(file.name);
  };
  const testId = `replay-${file.name}`;
  if (small)
    return (
      <ActionIcon
        variant="subtle"
        color="violet"
        disabled={reason !== null}
        aria-label={title}
        title={title}
        onClick={open}
        data-testid={testId}
      >
        <IconPlayerPlay size={18} aria-hidden />
      </ActionIcon>
    );
  return (
    <Button
      color="violet"
      disabled={reason !== null}
      title={title}
      leftSection={<IconPlayerPlay size={17} aria-hidden />}
      onClick={open}
      data-testid="replay"
    >
      {t("page.recordings.replay")}
    </Button>
  );
}

export function RecordingState({ state }: Pick<RecordingRef, "state">) {
  const t = useTexts();
  const { Icon, tone } = STATE_LOOKS[state];
  return (
    <span className={`${room.state} ${tone}`}>
      <Icon size={15} aria-hidden />
      {t(`page.recordings.state.${state}`)}
    </span>
  );
}

/** Facts of a file; those of the running one come from the link: its file does not tell them before it is closed. */
function factsOf(file: RecordingRef, link: LinkData | null) {
  const running = file.state === "live" ? (link?.recording ?? null) : null;
  const summary = file.summary;
  const startedNs = running?.since_ns ?? summary?.first_ns ?? summary?.started_ns ?? null;
  const durationMs =
    summary?.first_ns != null && summary.last_ns !== null ? (summary.last_ns - summary.first_ns) / 1e6 : null;
  return {
    startedMs: startedNs === null ? null : startedNs / 1e6,
    durationMs,
    frames: summary?.frames ?? null,
    lost: summary?.lost ?? running?.lost ?? null,
    events: summary?.events ?? null,
  };
}

const HIDDEN_FIRST = ["events"];

/** The running one first, then by when they were begun: a copied file is not a new one. */
function latestFirst(files: readonly RecordingRef[], link: LinkData | null): RecordingRef[] {
  const begun = (file: RecordingRef) =>
    file.state === "live" ? Infinity : (factsOf(file, link).startedMs ?? file.modified_ns / 1e6);
  return files.toSorted((a, b) => begun(b) - begun(a));
}

const orDash = (text: string | null | undefined) => (text == null || text === "" ? "–" : text);

function columnsOf(
  t: Translate,
  link: LinkData | null,
  replay: (file: string) => void,
): TableColumn<RecordingRef>[] {
  const facts = (file: RecordingRef) => factsOf(file, link);
  const count = (number: number | null) => (number === null ? "–" : figure(number, 0, t.language));
  const title = (id: string) => t(`page.recordings.column.${id}`);
  const numeric = true;
  return [
    {
      id: "state",
      title: title("state"),
      width: "minmax(186px, 0.9fr)",
      fixed: true,
      text: (file) =>
        [
          t(`page.recordings.state.${file.state}`),
          ...(file.sample ? [t("page.recordings.sample")] : []),
        ].join(" "),
      cell: (file) => (
        <span className={room.state}>
          <RecordingState state={file.state} />
          {file.sample && <span className={room.sample}>{t("page.recordings.sample")}</span>}
        </span>
      ),
    },
    {
      id: "started",
      title: title("started"),
      width: "minmax(152px, 1fr)",
      fixed: true,
      text: (file) => dayAndTime(facts(file).startedMs ?? file.modified_ns / 1e6),
      by: (file) => facts(file).startedMs ?? file.modified_ns / 1e6,
    },
    {
      id: "duration",
      title: title("duration"),
      width: "74px",
      numeric,
      text: (file) => {
        const { durationMs } = facts(file);
        return durationMs === null ? "–" : clock(durationMs);
      },
      by: (file) => facts(file).durationMs,
    },
    {
      id: "size",
      title: title("size"),
      width: "78px",
      numeric,
      text: (file) => bytes(file.size_bytes, t.language),
      by: (file) => file.size_bytes,
    },
    {
      id: "frames",
      title: title("frames"),
      width: "84px",
      numeric,
      text: (file) => count(facts(file).frames),
      by: (file) => facts(file).frames,
    },
    {
      id: "lost",
      title: title("lost"),
      width: "58px",
      numeric,
      text: (file) => count(facts(file).lost),
      by: (file) => facts(file).lost,
      cell: (file) => {
        const { lost } = facts(file);
        return <span className={lost !== null && lost > 0 ? "tone-error" : ""}>{count(lost)}</span>;
      },
    },
    {
      id: "events",
      title: title("events"),
      width: "58px",
      numeric,
      text: (file) => count(facts(file).events),
      by: (file) => facts(file).events,
    },
    {
      id: "turbine",
      title: title("turbine"),
      width: "minmax(92px, 0.7fr)",
      text: (file) => orDash(file.summary?.turbine.toUpperCase()),
    },
    {
      id: "person",
      title: title("person"),
      width: "minmax(70px, 0.7fr)",
      text: (file) => orDash(file.summary?.person),
    },
    {
      id: "file",
      title: title("file"),
      width: "minmax(120px, 1.6fr)",
      text: (file) => file.name,
    },
    {
      id: "replay",
      title: "",
      width: "44px",
      fixed: true,
      text: () => "",
      cell: (file) => <ReplayButton file={file} onReplay={replay} small />,
    },
    {
      id: "download",
      title: "",
      width: "44px",
      fixed: true,
      text: () => "",
      cell: (file) => <Download file={file} small />,
    },
  ];
}

export function Download({ file, small = false }: { file: RecordingRef; small?: boolean }) {
  const t = useTexts();
  const label = t("page.recordings.download", { name: file.name });
  const link = {
    component: "a" as const,
    href: recordingDownload(file.name),
    download: file.name,
    "aria-label": label,
    title: label,
  };
  if (!small)
    return (
      <Button {...link} leftSection={<IconDownload size={17} aria-hidden />} variant="default">
        {t("page.recordings.download_short")}
      </Button>
    );
  return (
    <ActionIcon {...link} variant="subtle" onClick={(event: React.MouseEvent) => event.stopPropagation()}>
      <IconDownload size={17} aria-hidden />
    </ActionIcon>
  );
}
