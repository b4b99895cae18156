import { Button, Loader } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useEffect } from "react";
import { exchange, type ExchangeJob, exchangeQuery } from "../../api/exchange";
import { recordingsQuery } from "../../api/files";
import { queryClient } from "../../api/queries";
import { usePageSearch } from "../../frame/search";
import { figure } from "../../model/values";
import { useTexts } from "../../texts/texts";
import classes from "./RecordingFiles.module.css";

/** How the making of a recording stands, and what came of it: what was repaired, left out, lost. */
export function Made({ id, onOpened }: { id: string; onOpened?: () => void }) {
  const t = useTexts();
  const job = useQuery(exchangeQuery(id));
  const state = job.data?.state;
  useEffect(() => {
    if (state === "done") void queryClient.invalidateQueries({ queryKey: recordingsQuery.queryKey });
  }, [state]);
  if (!job.data) return null;
  return (
    <div className={classes.made} role="status" data-testid="made" data-state={job.data.state}>
      {state === "running" && <Running job={job.data} />}
      {state === "done" && <Done job={job.data} {...(onOpened ? { onOpened } : {})} />}
      {state === "cancelled" && <p>{t("page.files.cancelled")}</p>}
      {job.data.error && (
        <p className="tone-error">
          <strong>{t("page.files.failed")}</strong> {t(job.data.error.text_key, job.data.error.details)}
        </p>
      )}
      <Report job={job.data} />
    </div>
  );
}

function Running({ job }: { job: ExchangeJob }) {
  const t = useTexts();
  const done = job.action === "cut" ? `${job.done} %` : figure(job.done, 0, t.language);
  return (
    <p>
      <Loader size={14} aria-hidden /> {t("page.files.running", { done })}{" "}
      <Button variant="default" onClick={() => void exchange.cancel(job.id)}>
        {t("page.cancel")}
      </Button>
    </p>
  );
}

function Done({ job, onOpened }: { job: ExchangeJob; onOpened?: () => void }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  return (
    <p>
      {t("page.files.done", { frames: figure(job.frames, 0, t.language) })}{" "}
      {job.files.map((file) => (
        <Button
          key={file}
          variant="subtle"
          onClick={() => {
            update({ file });
            onOpened?.();
          }}
          data-testid="made-file"
        >
          {file}
        </Button>
      ))}
    </p>
  );
}

function Report({ job }: { job: ExchangeJob }) {
  const t = useTexts();
  if (job.remarks.length === 0 && job.skipped.length === 0) return null;
  return (
    <ul className={classes.losses}>
      {job.remarks.map((one) => (
        <li key={one.what}>{t(one.text_key, one.details)}</li>
      ))}
      {job.skipped.map(({ line, text }) => (
        <li key={line}>{t("exchange.import.skipped_line", { line, text })}</li>
      ))}
    </ul>
  );
}
