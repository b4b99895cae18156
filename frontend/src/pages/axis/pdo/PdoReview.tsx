import { Alert, Button, Group, Progress, Stack, Text } from "@mantine/core";
import { IconArrowBackUp } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { commands } from "../../../api/client";
import { type PdoPreview, type PdoWrite } from "../../../api/pdo";
import type { Job, JobRow } from "../../../api/types";
import { useTexts } from "../../../texts/texts";
import { Dialog } from "../../../ui/Dialog";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { Findings } from "./Findings";
import { rateText, share } from "./names";
import classes from "./Pdo.module.css";

interface Props {
  preview: PdoPreview | undefined;
  job: Job | undefined;
  starting: boolean;
  error: Error | null;
  device: string;
  bitrate: number;
  onApply: () => void;
  onUndo: (() => void) | null;
  onClose: () => void;
}

const HEX = 16;

/** What will be written, in its order; then how far it is, and what became of it. */
export function PdoReview(props: Props) {
  const t = useTexts();
  const { job, preview, starting, error, onApply, onClose } = props;
  return (
    <Dialog
      opened
      onClose={onClose}
      closeOnClickOutside={false}
      size={860}
      title={<Text fw={700}>{t("page.pdo.review")}</Text>}
      data-testid="pdo-dialog"
    >
      <Stack gap="md">
        {error !== null && <ProblemAlert error={error} title={t("page.pdo.failed")} />}
        {job === undefined ? (
          <>
            <Text size="sm">{t("page.pdo.review_text")}</Text>
            <Findings findings={(preview?.findings ?? []).filter((one) => one.severity === "warning")} />
            <ol className={classes.writes}>
              {(preview?.writes ?? []).map((write, place) => (
                <Write key={place} write={write} />
              ))}
            </ol>
            {preview && <Costs {...props} preview={preview} />}
            <Group justify="flex-end">
              <Button variant="default" h={40} onClick={onClose}>
                {t("page.pdo.later")}
              </Button>
              <Button h={40} loading={starting} onClick={onApply} data-testid="pdo-apply">
                {t("page.pdo.apply", { count: preview?.writes.length ?? 0 })}
              </Button>
            </Group>
          </>
        ) : (
          <Progressing {...props} job={job} />
        )}
      </Stack>
    </Dialog>
  );
}

const hex = (raw: number) => `${raw.toString(HEX).toUpperCase()}h`;
/** Identifiers and mapped objects are known by their hexadecimal form; numbers and times are numbers. */
const IN_HEX: readonly string[] = ["disable", "map", "enable", "cob_id"];
const PARAMETERS: Readonly<Record<string, string>> = {
  "02": "transmission",
  "03": "inhibit",
  "05": "event",
  "06": "sync_start",
};

function Write({ write }: { write: PdoWrite }) {
  const t = useTexts();
  const value = IN_HEX.includes(write.step) ? hex : String;
  const parameter = write.step === "parameter" ? PARAMETERS[write.address.slice(-2)] : undefined;
  const step = t(`page.pdo.step.${write.step}`);
  return (
    <li>
      <span>{write.pdo}</span>
      <span className={classes.address}>{write.address}</span>
      <span>{parameter === undefined ? step : `${t(`page.pdo.${parameter}`)}: ${step}`}</span>
      <span>
        <span className="dim">{write.was_raw === null ? "–" : value(write.was_raw)}</span> →{" "}
        <b>{value(write.raw)}</b>
      </span>
    </li>
  );
}

function Costs({ preview, device, bitrate }: Props & { preview: PdoPreview }) {
  const t = useTexts();
  const rows = preview.cost.rows.filter(
    (row) => row.device === device && (row.now.basis !== "off" || row.after.basis !== "off"),
  );
  return (
    <details className={classes.costs}>
      <summary>{t("page.pdo.load_title", { bitrate: (bitrate / 1000).toLocaleString(t.language) })}</summary>
      <ul>
        {rows.map((row) => (
          <li key={`${row.direction}${row.number}`}>
            <b>{`${row.direction.toUpperCase()}${row.number}`}</b>
            <span>
              {rateText(row.now.per_second, t)} · {share(row.now.share, t)} →{" "}
              {rateText(row.after.per_second, t)} · {share(row.after.share, t)}
            </span>
            <span className="dim">
              {row.after.certain
                ? t(`page.pdo.basis.${row.after.basis}`)
                : t("page.pdo.load_assumed", { basis: t(`page.pdo.basis.${row.after.basis}`) })}
            </span>
          </li>
        ))}
      </ul>
    </details>
  );
}

function Progressing({ job, onUndo, onClose }: Props & { job: Job }) {
  const t = useTexts();
  const cancel = useMutation({ mutationFn: commands.cancel });
  const label = t("page.pdo.applying", { done: job.done, total: job.total });
  const running = job.state === "running";
  return (
    <>
      {running ? (
        <div role="status">{label}</div>
      ) : (
        <Alert
          color={job.state === "done" ? "green" : "orange"}
          variant="light"
          role="status"
          title={t(`page.pdo.state.${job.state}`)}
          data-testid={`pdo-${job.state}`}
        >
          {job.error && (
            <>
              <div>{t(job.error.text_key, job.error.details)}</div>
              {t.has(`page.next.${job.error.code}`) && <b>{t(`page.next.${job.error.code}`)}</b>}
            </>
          )}
        </Alert>
      )}
      <Progress value={job.total > 0 ? (100 * job.done) / job.total : 0} aria-label={label} />
      <ol className={classes.writes}>
        {job.rows.map((row, place) => (
          <Row key={place} row={row} />
        ))}
      </ol>
      <Group justify="space-between">
        <div>
          {onUndo && (
            <Button
              variant="default"
              h={40}
              leftSection={<IconArrowBackUp size={17} aria-hidden />}
              onClick={onUndo}
              data-testid="pdo-dialog-undo"
            >
              {t("page.pdo.put_back")}
            </Button>
          )}
        </div>
        {running ? (
          <Button
            color="orange"
            variant="light"
            h={40}
            disabled={cancel.isPending || cancel.isSuccess}
            onClick={() => cancel.mutate(job.id)}
          >
            {t("page.review.cancel")}
          </Button>
        ) : (
          <Button h={40} onClick={onClose} data-testid="pdo-close">
            {t("page.close")}
          </Button>
        )}
      </Group>
    </>
  );
}

function Row({ row }: { row: JobRow }) {
  const t = useTexts();
  const value = (raw: JobRow["was_raw"]) => (typeof raw === "number" ? hex(raw) : "–");
  return (
    <li data-state={row.state}>
      <span className={classes.address}>{row.address}</span>
      <span>
        <span className="dim">{value(row.was_raw)}</span> → <b>{value(row.read_raw)}</b>
      </span>
      <span>{t(`page.row_state.${row.state}`)}</span>
      {row.error && <span className="tone-error">{t(row.error.text_key, row.error.details)}</span>}
    </li>
  );
}
