import { Button, Progress, TextInput } from "@mantine/core";
import { IconDeviceFloppy, IconX } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useEffect, useState } from "react";
import { commands } from "../../../api/client";
import { setsQuery } from "../../../api/sets";
import { jobQuery, queryClient, turbineQuery } from "../../../api/queries";
import type { Job } from "../../../api/types";
import { NeedsRole } from "../../../frame/NeedsRole";
import { useHearing, useLink } from "../../../live/live";
import { useTexts } from "../../../texts/texts";
import { age } from "../../../ui/format";
import { notify } from "../../../ui/notices";
import { storyOf } from "../../../ui/problem";
import classes from "./Library.module.css";

const MAX_REASON = 500;
const KEY = ["backing-up"];

interface Begun {
  id: string;
  atMs: number;
}

/** The job goes on whatever room is looked at: it is kept beside the page. */
function useBackup() {
  const begun = useQuery({ queryKey: KEY, queryFn: () => null as Begun | null, staleTime: Infinity }).data;
  const job = useQuery(jobQuery(begun?.id ?? null)).data;
  return { begun, job };
}

/** Reads every device of the turbine and keeps a set of each; nothing is written to a device. */
export function BackUp() {
  const t = useTexts();
  const turbine = useQuery(turbineQuery).data;
  const [reason, setReason] = useState("");
  const hearing = useHearing().state === "hearing";
  const connected = useLink()?.state === "connected";
  const { begun, job } = useBackup();
  const failed = (error: unknown) => {
    const story = storyOf(error, t);
    notify({ tone: "error", title: t("page.sets.backup_failed"), lines: [story.happened, story.next] });
  };
  const start = useMutation({
    mutationFn: commands.backup,
    onSuccess: (started: Job) => {
      queryClient.setQueryData(["job", started.id], started);
      queryClient.setQueryData(KEY, { id: started.id, atMs: Date.now() } satisfies Begun);
      setReason("");
    },
    onError: failed,
  });
  const cancel = useMutation({ mutationFn: commands.cancel, onError: failed });
  useTellTheEnd(job);
  if (begun && job?.state === "running")
    return <Running job={job} begun={begun} onCancel={() => cancel.mutate(job.id)} />;
  const able = hearing && connected && turbine != null;
  return (
    <form
      className={classes.backup}
      onSubmit={(event) => {
        event.preventDefault();
        if (able) start.mutate(reason.trim());
      }}
    >
      <NeedsRole role="technician" device>
        {(locked) => (
          <Button
            type="submit"
            disabled={locked || !able}
            loading={start.isPending}
            leftSection={<IconDeviceFloppy size={18} aria-hidden />}
            data-testid="back-up"
          >
            {t("page.sets.back_up", { turbine: turbine?.name ?? "–" })}
          </Button>
        )}
      </NeedsRole>
      <TextInput
        aria-label={t("page.sets.reason")}
        placeholder={t("page.sets.reason")}
        value={reason}
        maxLength={MAX_REASON}
        onChange={(event) => setReason(event.currentTarget.value)}
        disabled={!able}
        data-testid="reason"
      />
      {!able && <span className="dim">{t("page.sets.needs_connection")}</span>}
    </form>
  );
}

function Running({ job, begun, onCancel }: { job: Job; begun: Begun; onCancel: () => void }) {
  const t = useTexts();
  const [nowMs, setNowMs] = useState(begun.atMs);
  useEffect(() => {
    const timer = setInterval(() => setNowMs(Date.now()), 500);
    return () => clearInterval(timer);
  }, []);
  const part = job.total === 0 ? 0 : job.done / job.total;
  const ranMs = nowMs - begun.atMs;
  const left = part > 0.05 ? t("page.sets.left", { time: age((ranMs / part) * (1 - part), t.language) }) : "";
  return (
    <div className={classes.running} role="status" data-testid="backup-running">
      <div>
        <span>{t("page.sets.reading", { done: job.done, total: job.total })}</span>{" "}
        <span className="dim">{left}</span>
        <Progress value={part * 100} aria-label={t("page.sets.progress")} />
      </div>
      <Button
        variant="default"
        leftSection={<IconX size={17} aria-hidden />}
        onClick={onCancel}
        data-testid="backup-cancel"
      >
        {t("page.cancel")}
      </Button>
    </div>
  );
}

/** Says once how the backup ended, and has the list asked again. */
function useTellTheEnd(job: Job | undefined): void {
  const t = useTexts();
  useEffect(() => {
    if (!job || job.state === "running") return;
    queryClient.setQueryData(KEY, null);
    void queryClient.invalidateQueries({ queryKey: setsQuery.queryKey });
    const missing = job.failed.map((one) => `${one.address}: ${t(one.text_key, one.details)}`);
    if (job.state === "cancelled")
      return notify({
        tone: "warning",
        title: t("page.sets.cancelled"),
        lines: [t("page.sets.cancelled_state")],
      });
    if (job.error)
      return notify({
        tone: "error",
        title: t("page.sets.backup_failed"),
        lines: [t(job.error.text_key, job.error.details)],
      });
    notify({
      tone: missing.length === 0 ? "ok" : "warning",
      title: t(missing.length === 0 ? "page.sets.done" : "page.sets.done_partly", { count: missing.length }),
      lines: missing.slice(0, 5),
    });
  }, [job, t]);
}
