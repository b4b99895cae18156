import { ActionIcon, Button } from "@mantine/core";
import { IconEdit, IconPlayerPlay, IconPlus, IconTrash } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import {
  type Annotation,
  annotations,
  annotationsQuery,
  type Incident,
  incidentKeys,
  type Severity,
} from "../../../api/incidents";
import { queryClient } from "../../../api/queries";
import { NeedsRole } from "../../../frame/NeedsRole";
import { useOpenReplay } from "../../../replay/leaving";
import { Note } from "../../../replay/MarkMomentNote";
import { Range, stretchOf, type Written, writtenOf } from "../../../replay/MarkMomentForm";
import { MarkMomentFrame } from "../../../replay/MarkMomentFrame";
import { useTexts } from "../../../texts/texts";
import { timeOfDay } from "../../../ui/format";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import room from "../../../ui/Room.module.css";
import classes from "./Incidents.module.css";

const TONES: Record<Severity, string> = { info: "", warning: "tone-warning", error: "tone-error" };

/** What was noted at the recording of an incident. */
export function Annotations({ incident }: { incident: Incident }) {
  const t = useTexts();
  const listed = useQuery(annotationsQuery(incident.recording));
  const [editing, setEditing] = useState<Annotation | "new" | null>(null);
  const removing = useMutation({
    mutationFn: annotations.remove,
    onSuccess: () => queryClient.invalidateQueries(incidentKeys),
  });
  const there = incident.replay !== null;
  return (
    <div>
      <h3>{t("page.incidents.annotations")}</h3>
      {listed.isError && <ProblemAlert error={listed.error} title={t("page.incidents.annotations_failed")} />}
      {listed.data?.problem != null && <p className="tone-warning">{listed.data.problem}</p>}
      {removing.isError && <ProblemAlert error={removing.error} title={t("page.mark.failed")} />}
      <ul className={room.list} data-testid="annotations">
        {listed.data?.annotations.map((one) => (
          <li key={one.id}>
            <span className={TONES[one.severity]}>
              <span className="dim">{timeOfDay(one.from_ns / 1e6)}</span> {one.text}
            </span>
            <Tools
              one={one}
              there={there}
              recording={incident.recording}
              onEdit={() => setEditing(one)}
              onRemove={() => removing.mutate(one.id)}
            />
          </li>
        ))}
      </ul>
      {there && (
        <NeedsRole role="technician">
          {(locked) => (
            <Button
              variant="default"
              mt={6}
              disabled={locked}
              leftSection={<IconPlus size={17} aria-hidden />}
              onClick={() => setEditing("new")}
              data-testid="add-annotation"
            >
              {t("page.incidents.annotate")}
            </Button>
          )}
        </NeedsRole>
      )}
      {editing !== null && (
        <Editor
          incident={incident}
          annotation={editing === "new" ? null : editing}
          onClose={() => setEditing(null)}
        />
      )}
    </div>
  );
}

interface ToolsProps {
  one: Annotation;
  there: boolean;
  recording: string;
  onEdit: () => void;
  onRemove: () => void;
}

function Tools({ one, there, recording, onEdit, onRemove }: ToolsProps) {
  const t = useTexts();
  const replay = useOpenReplay();
  const label = (what: string) => t(`page.incidents.annotation.${what}`, { text: one.text });
  return (
    <span className={classes.tools}>
      <ActionIcon
        variant="subtle"
        color="violet"
        disabled={!there}
        aria-label={label("jump")}
        title={label("jump")}
        onClick={() => replay(recording, one.from_ns)}
      >
        <IconPlayerPlay size={17} aria-hidden />
      </ActionIcon>
      <NeedsRole role="technician">
        {(locked) => (
          <ActionIcon
            variant="subtle"
            disabled={locked || !there}
            aria-label={label("edit")}
            title={label("edit")}
            onClick={onEdit}
          >
            <IconEdit size={17} aria-hidden />
          </ActionIcon>
        )}
      </NeedsRole>
      <NeedsRole role="technician">
        {(locked) => (
          <ActionIcon
            variant="subtle"
            disabled={locked}
            aria-label={label("remove")}
            title={label("remove")}
            onClick={onRemove}
          >
            <IconTrash size={17} aria-hidden />
          </ActionIcon>
        )}
      </NeedsRole>
    </span>
  );
}

interface EditorProps {
  incident: Incident;
  annotation: Annotation | null;
  onClose: () => void;
}

function Editor({ incident, annotation, onClose }: EditorProps) {
  const t = useTexts();
  const atNs = annotation?.from_ns ?? incident.at_ns;
  const [severity, setSeverity] = useState<Severity>(annotation?.severity ?? "warning");
  const [written, setWritten] = useState<Written>(() =>
    writtenOf({
      from_ns: atNs,
      to_ns: annotation?.to_ns ?? atNs,
      at_ns: atNs,
      title: annotation?.text ?? "",
      notes: "",
      tags: [],
    }),
  );
  const change = (part: Partial<Written>) => setWritten((before) => ({ ...before, ...part }));
  const stretch = stretchOf(written, atNs, true);
  const keeping = useMutation({
    mutationFn: async () => {
      if (stretch === null) return;
      const words = { ...stretch, text: written.title, severity };
      if (annotation) await annotations.change(annotation.id, words);
      else await annotations.add(incident.recording, words, incident.id);
      onClose();
    },
    onSuccess: () => queryClient.invalidateQueries(incidentKeys),
  });
  return (
    <MarkMomentFrame
      title={t("page.incidents.annotation_title")}
      name="annotation"
      keep={t("page.incidents.keep")}
      ready={stretch !== null && written.title.trim() !== ""}
      keeping={keeping}
      onClose={onClose}
    >
      <Note
        text={written.title}
        severity={severity}
        onText={(title) => change({ title })}
        onSeverity={setSeverity}
      />
      <Range atNs={atNs} written={written} onChange={change} point />
    </MarkMomentFrame>
  );
}
