import { Button, Textarea, TextInput } from "@mantine/core";
import { IconPencil, IconPlayerPlay } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import { queryClient } from "../../../api/queries";
import { type Capture, type KeptMark, scopeKeys, scopeOrders } from "../../../api/scope";
import { useRole } from "../../../frame/role";
import { usePageSearch } from "../../../frame/search";
import { useOpenReplay } from "../../../replay/leaving";
import { localise } from "../../../model/values";
import { type Translate, useTexts } from "../../../texts/texts";
import { useDeviceName } from "../../../ui/devices";
import { Dialog } from "../../../ui/Dialog";
import { dayAndTime } from "../../../ui/format";
import { HoldButton } from "../../../ui/HoldButton";
import { notify } from "../../../ui/notices";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import classes from "./Scope.module.css";
import { secondsText } from "./traces";

const MARKS_SHOWN = 20;

/** What a capture is, and who made it. */
export function CaptureTitle({ capture }: { capture: Capture }) {
  const t = useTexts();
  return (
    <div className={classes.captureTitle}>
      <h2 data-testid="capture-name">{capture.head.name}</h2>
      <p className={classes.told} data-testid="capture-facts">
        {factsOf(capture, t).join(" · ")}
      </p>
    </div>
  );
}

/** What happened in a capture, and what can be done with it. */
export function CaptureFacts({ capture }: { capture: Capture }) {
  const t = useTexts();
  const { head, kept } = capture;
  const role = useRole();
  const replay = useOpenReplay();
  const [editing, setEditing] = useState(false);
  const { recording } = head;
  return (
    <section className={classes.facts} aria-label={head.name}>
      <div className={classes.factsHead}>
        <Button
          variant="default"
          leftSection={<IconPencil size={17} aria-hidden />}
          disabled={!role.may("technician")}
          title={role.why("technician") ?? undefined}
          onClick={() => setEditing(true)}
          data-testid="edit-capture"
        >
          {t(kept ? "page.scope.rename" : "page.scope.keep")}
        </Button>
        <Button
          variant="default"
          leftSection={<IconPlayerPlay size={17} aria-hidden />}
          disabled={recording === null}
          title={recording ?? t("page.scope.jump_none")}
          onClick={() => recording !== null && replay(recording, head.trigger_ns)}
          data-testid="to-recording"
        >
          {t("page.scope.jump")}
        </Button>
      </div>
      {head.note !== "" && <p className={classes.note}>{head.note}</p>}
      <Marks capture={capture} />
      {editing && <Edit capture={capture} onClose={() => setEditing(false)} />}
    </section>
  );
}

function factsOf({ head, kept }: Capture, t: Translate): string[] {
  const gaps = head.marks.filter((one) => one.what === "gap").length;
  const count = head.signals.reduce((sum, one) => sum + one.count, 0);
  const seenS = (head.trigger_ns - head.known_ns) / 1e9;
  return [
    head.turbine_name,
    ...(head.twin ? [t("page.scope.twin")] : []),
    dayAndTime(head.trigger_ns / 1e6),
    head.person,
    t(`page.scope.cause_${head.cause}`),
    t(`page.scope.ended_${head.ended}`),
    t("page.scope.samples", { count }),
    ...(head.known_ns > head.start_ns
      ? [t("page.scope.pre_short", { seconds: localise(Math.max(0, seenS).toFixed(2), t.language) })]
      : []),
    ...(gaps === 0 ? [] : [t(gaps === 1 ? "page.scope.gaps_one" : "page.scope.gaps", { count: gaps })]),
    ...(kept ? [] : [t("page.scope.not_kept")]),
  ];
}

function Marks({ capture: { head } }: { capture: Capture }) {
  const t = useTexts();
  const deviceName = useDeviceName();
  if (head.marks.length === 0) return null;
  return (
    <details className={classes.marks}>
      <summary>
        {t("page.scope.marks")} <span className="dim">({head.marks.length})</span>
      </summary>
      <ul className="bench">
        {head.marks.slice(0, MARKS_SHOWN).map((mark, at) => (
          <li key={at}>
            <span>{secondsText((mark.t_ns - head.trigger_ns) / 1e9, t)} s</span>{" "}
            {mark.device === null ? mark.bus : deviceName(mark.device)}: {markText(mark, t)}
          </li>
        ))}
      </ul>
    </details>
  );
}

function markText({ what, detail }: KeptMark, t: Translate): string {
  if (what === "emcy") return t("page.scope.mark_emcy", { code: detail });
  if (what === "gap") return t("page.scope.mark_gap", { reason: t(detail) });
  return what === "boot_up" ? t("page.scope.mark_boot_up") : t("page.scope.mark_nmt", { state: t(detail) });
}

function Edit({ capture: { head, kept }, onClose }: { capture: Capture; onClose: () => void }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const [name, setName] = useState(head.name);
  const [note, setNote] = useState(head.note);
  const refresh = () => queryClient.invalidateQueries(scopeKeys);
  const keeping = useMutation({
    mutationFn: () => scopeOrders.change(head.id, name.trim(), note),
    onSuccess: async () => {
      await refresh();
      onClose();
    },
  });
  const removing = useMutation({
    mutationFn: () => scopeOrders.remove(head.id),
    onSuccess: async () => {
      update({ capture: undefined });
      notify({ tone: "ok", title: t("page.scope.deleted", { name: head.name }), lines: [] });
      await refresh();
      onClose();
    },
  });
  const error = keeping.error ?? removing.error;
  return (
    <Dialog opened onClose={onClose} title={t(kept ? "page.scope.rename" : "page.scope.keep")}>
      <form
        className={classes.form}
        onSubmit={(event) => {
          event.preventDefault();
          keeping.mutate();
        }}
      >
        {error && <ProblemAlert error={error} title={t("page.scope.change_failed")} />}
        <TextInput
          label={t("page.scope.name")}
          value={name}
          maxLength={120}
          onChange={(event) => setName(event.currentTarget.value)}
          data-autofocus
          data-testid="capture-name-field"
        />
        <Textarea
          label={t("page.scope.note")}
          value={note}
          maxLength={4000}
          minRows={3}
          autosize
          onChange={(event) => setNote(event.currentTarget.value)}
          data-testid="capture-note-field"
        />
        <div className={classes.buttons}>
          <Button type="submit" disabled={name.trim() === "" || keeping.isPending} data-testid="save-capture">
            {t("page.scope.save")}
          </Button>
          <Button variant="default" onClick={onClose}>
            {t("page.scope.cancel")}
          </Button>
          <span className={classes.spacer} />
          <HoldButton
            tone="danger"
            hint={t("page.scope.delete")}
            onHeld={() => removing.mutate()}
            testId="delete-capture"
          >
            {t("page.scope.delete")}
          </HoldButton>
        </div>
      </form>
    </Dialog>
  );
}
