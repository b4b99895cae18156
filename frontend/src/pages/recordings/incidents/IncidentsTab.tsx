import { IconAlertTriangle, IconCircleCheck, IconFileOff } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { type Incident, incidentQuery, incidentsQuery } from "../../../api/incidents";
import { usePageSearch } from "../../../frame/search";
import { type Translate, useTexts } from "../../../texts/texts";
import { DataTable, type TableColumn } from "../../../ui/DataTable";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import room from "../../../ui/Room.module.css";
import { dateAndTime, dayAndTime } from "../../../ui/format";
import { IncidentDetails } from "./IncidentDetails";
import { useOpenIncident } from "./openIncident";
import { TakeBundle } from "./TakeBundle";

/** What was marked, with the moment to go back to; one of them opened below. */
export function IncidentsTab() {
  const t = useTexts();
  const [{ incident: code }, update] = usePageSearch();
  const list = useQuery(incidentsQuery);
  const opened = useQuery(incidentQuery(code));
  const open = useOpenIncident();
  const columns = useMemo(() => columnsOf(t), [t]);
  const show = (incident: string) => update({ incident });
  return (
    <div className={room.room}>
      <div className={room.strip}>
        <h1>{t("page.recordings.tab.incidents")}</h1>
        <span className="dim">{t("page.incidents.how")}</span>
        <span className={room.spacer} />
        <TakeBundle onTaken={show} />
      </div>
      {list.isError && <ProblemAlert error={list.error} title={t("page.incidents.failed")} />}
      <DataTable
        label={t("page.recordings.tab.incidents")}
        rows={list.data ?? []}
        columns={columns}
        idOf={(one) => one.code}
        fileName="hubside-incidents"
        empty={t(list.isPending ? "page.loading" : "page.incidents.none")}
        onOpen={(one) => show(one.code)}
        onRun={(one) => one.replay !== null && open(one)}
        selected={code}
        name="incident"
      />
      {opened.data && <IncidentDetails key={opened.data.id} incident={opened.data} />}
      {opened.isError && <ProblemAlert error={opened.error} title={t("page.incidents.not_found")} />}
    </div>
  );
}

/** Whether its recording is there, in one word and a sign. */
export function RecordingStanding({ incident }: { incident: Incident }) {
  const t = useTexts();
  const { recording_state: state } = incident;
  const there = incident.replay !== null;
  const Icon = state === "there" ? IconCircleCheck : there ? IconAlertTriangle : IconFileOff;
  return (
    <span
      className={`${room.state ?? ""} ${there ? "" : "tone-warning"}`}
      title={t(incident.recording_text_key)}
    >
      <Icon size={15} aria-hidden />
      {t(`page.incidents.state.${state}`)}
    </span>
  );
}

function columnsOf(t: Translate): TableColumn<Incident>[] {
  const title = (id: string) => t(`page.incidents.column.${id}`);
  return [
    {
      id: "time",
      title: title("time"),
      width: "156px",
      fixed: true,
      text: (one) => dayAndTime(one.at_ns / 1e6),
      by: (one) => one.at_ns,
    },
    {
      id: "turbine",
      title: title("turbine"),
      width: "minmax(70px, 0.5fr)",
      text: (one) => one.turbine.toUpperCase(),
    },
    {
      id: "title",
      title: title("title"),
      width: "minmax(180px, 2.4fr)",
      fixed: true,
      text: (one) => one.title,
    },
    { id: "tags", title: title("tags"), width: "minmax(90px, 1fr)", text: (one) => one.tags.join(", ") },
    {
      id: "recording",
      title: title("recording"),
      width: "minmax(130px, 1.2fr)",
      text: (one) => one.recording,
    },
    {
      id: "state",
      title: title("state"),
      width: "130px",
      text: (one) => t(`page.incidents.state.${one.recording_state}`),
      cell: (one) => <RecordingStanding incident={one} />,
    },
    { id: "author", title: title("author"), width: "minmax(90px, 0.7fr)", text: (one) => one.author },
    {
      id: "created",
      title: title("created"),
      width: "138px",
      text: (one) => dateAndTime(one.created_ns / 1e6),
      by: (one) => one.created_ns,
    },
  ];
}
