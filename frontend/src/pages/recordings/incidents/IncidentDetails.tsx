import { Button, CloseButton } from "@mantine/core";
import {
  IconEdit,
  IconEyeOff,
  IconFileText,
  IconLink,
  IconPackageExport,
  IconPlayerPlay,
} from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import {
  bundleDownload,
  type Incident,
  incidentKeys,
  incidents,
  reportDownload,
} from "../../../api/incidents";
import { queryClient } from "../../../api/queries";
import { NeedsRole } from "../../../frame/NeedsRole";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { copyText } from "../../../ui/copyText";
import { dayAndTime, timeOfDay } from "../../../ui/format";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import room from "../../../ui/Room.module.css";
import { Pairs } from "../RecordingDetails";
import { Annotations } from "./Annotations";
import { EditIncident } from "./EditIncident";
import classes from "./Incidents.module.css";
import { RecordingStanding } from "./IncidentsTab";
import { useOpenIncident } from "./openIncident";
import { Versions } from "./Versions";

/** What was written down of a moment, and all that can be done with it. */
export function IncidentDetails({ incident }: { incident: Incident }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  return (
    <section className={room.details} aria-label={incident.title} data-testid="incident-details">
      <div className={room.detailsHead}>
        <h2>{incident.title}</h2>
        <RecordingStanding incident={incident} />
        <span className={room.spacer} />
        <Actions incident={incident} />
        <CloseButton aria-label={t("page.close")} onClick={() => update({ incident: undefined })} />
      </div>
      <NotThere incident={incident} />
      {incident.hidden && <p className={room.note}>{t("page.incidents.hidden")}</p>}
      <div className={room.detailsBody}>
        <div className={room.columns}>
          <Facts incident={incident} />
          <div>
            <h3>{t("page.mark.notes")}</h3>
            <p className={classes.notes}>{incident.notes || t("page.incidents.no_notes")}</p>
            <Plots incident={incident} />
          </div>
          <Annotations incident={incident} />
          <Versions incident={incident} />
        </div>
      </div>
    </section>
  );
}

/** The recording is missing, or another: said clearly, with what can be done. */
function NotThere({ incident }: { incident: Incident }) {
  const t = useTexts();
  const { recording_state: state } = incident;
  if (state === "there") return null;
  const next = `page.incidents.next.${state}`;
  return (
    <p className={room.note} data-testid="recording-standing">
      <strong>{t(incident.recording_text_key)}</strong> {t(next, { recording: incident.recording })}
    </p>
  );
}

function Actions({ incident }: { incident: Incident }) {
  const t = useTexts();
  const open = useOpenIncident();
  const [editing, setEditing] = useState(false);
  const { code } = incident;
  const link = new URL(incident.link, location.href).href;
  const icon = (Icon: typeof IconLink) => <Icon size={17} aria-hidden />;
  return (
    <>
      <Button
        color="violet"
        disabled={incident.replay === null}
        title={incident.replay === null ? t(incident.recording_text_key) : undefined}
        leftSection={icon(IconPlayerPlay)}
        onClick={() => open(incident)}
        data-testid="open-incident"
      >
        {t("page.recordings.replay")}
      </Button>
      <Button
        variant="default"
        leftSection={icon(IconLink)}
        title={link}
        onClick={() => copyText(link, t)}
        data-testid="copy-link"
      >
        {t("page.incidents.link")}
      </Button>
      <Button
        variant="default"
        component="a"
        href={reportDownload(code, t.language)}
        download
        leftSection={icon(IconFileText)}
        title={t("page.incidents.report_why")}
        data-testid="report"
      >
        {t("page.incidents.report")}
      </Button>
      <Button
        variant="default"
        component="a"
        href={bundleDownload(code)}
        download
        leftSection={icon(IconPackageExport)}
        title={t("page.incidents.bundle_why")}
        data-testid="bundle"
      >
        {t("page.incidents.bundle")}
      </Button>
      <NeedsRole role="technician">
        {(locked) => (
          <Button
            variant="default"
            disabled={locked}
            leftSection={icon(IconEdit)}
            onClick={() => setEditing(true)}
            data-testid="edit-incident"
          >
            {t("page.incidents.edit")}
          </Button>
        )}
      </NeedsRole>
      <Hide incident={incident} />
      {editing && <EditIncident incident={incident} onClose={() => setEditing(false)} />}
    </>
  );
}

/** Takes it off the list; its link and its versions stay. */
function Hide({ incident }: { incident: Incident }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const hiding = useMutation({
    mutationFn: () => incidents.hide(incident.code),
    onSuccess: () => {
      update({ incident: undefined });
      return queryClient.invalidateQueries(incidentKeys);
    },
  });
  if (incident.hidden) return null;
  return (
    <>
      <NeedsRole role="expert">
        {(locked) => (
          <Button
            variant="default"
            disabled={locked}
            loading={hiding.isPending}
            leftSection={<IconEyeOff size={17} aria-hidden />}
            title={locked ? undefined : t("page.incidents.hide_means")}
            onClick={() => hiding.mutate()}
            data-testid="hide-incident"
          >
            {t("page.incidents.hide")}
          </Button>
        )}
      </NeedsRole>
      {hiding.isError && <ProblemAlert error={hiding.error} title={t("page.incidents.hide_failed")} />}
    </>
  );
}

function Facts({ incident }: { incident: Incident }) {
  const t = useTexts();
  const { at_ns, from_ns, to_ns, loop, origin } = incident;
  const fact = (name: string) => t(`page.incidents.fact.${name}`);
  const stretch = (from: number, to: number) => `${timeOfDay(from / 1e6)} – ${timeOfDay(to / 1e6)}`;
  const pairs: [string, string][] = [
    [fact("turbine"), incident.turbine.toUpperCase()],
    [fact("moment"), `${dayAndTime(at_ns / 1e6)}.${timeOfDay(at_ns / 1e6).slice(-3)}`],
    [fact("stretch"), stretch(from_ns, to_ns)],
    ...(loop ? [[fact("loop"), stretch(loop.from_ns, loop.to_ns)] as [string, string]] : []),
    [fact("recording"), incident.recording],
    [fact("link"), incident.link],
    [fact("tags"), incident.tags.join(", ") || "–"],
    [fact("author"), incident.author],
    ...(incident.camera ? [[fact("camera"), incident.camera] as [string, string]] : []),
    ...(origin ? [[fact("origin"), t("page.incidents.origin", { ...origin })] as [string, string]] : []),
  ];
  return (
    <div>
      <h3>{t("page.incidents.facts")}</h3>
      <Pairs pairs={pairs} />
    </div>
  );
}

function Plots({ incident }: { incident: Incident }) {
  const t = useTexts();
  if (incident.plots.length === 0) return null;
  return (
    <>
      <h3 className={classes.next}>{t("desk.plots")}</h3>
      <ul className={classes.plots}>
        {incident.plots.map((signals) => (
          <li key={signals.join()}>{signals.join(", ")}</li>
        ))}
      </ul>
    </>
  );
}
