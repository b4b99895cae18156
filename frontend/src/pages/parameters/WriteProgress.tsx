import { Alert, Button, Group, Progress as Bar, Stack } from "@mantine/core";
import { IconArrowBackUp, IconPlayerStop } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { commands, Problem } from "../../api/client";
import type { Failure, Job, JobRow, Raw } from "../../api/types";
import { useAxes, useNodes } from "../../live/live";
import { titleOf } from "../../model/rows";
import { type DeviceContext, lineOf, shownOf } from "../../model/shown";
import { keyOf, type Outcome as Ended, type Writing } from "../../model/staged";
import { type Translate, useTexts } from "../../texts/texts";
import { type Place, useDeviceName } from "../../ui/devices";
import { storyOf } from "../../ui/problem";
import { useContexts } from "./devicesOf";
import classes from "./Parameters.module.css";
import { entriesOf, staged, useStaged } from "./staging";
import { useWriting } from "./writing";

interface Common {
  places: readonly Place[];
  onClose: () => void;
}

/** Row by row while it runs; ending it finishes the row that is on its way and leaves the others pending. */
export function Progress({ writing, places, onClose }: Common & { writing: Writing }) {
  const t = useTexts();
  const { job } = useWriting();
  const cancel = useMutation({ mutationFn: commands.cancel });
  const label = t("page.review.writing", { done: job?.done ?? 0, total: job?.total ?? 0 });
  const share = job && job.total > 0 ? (100 * job.done) / job.total : 0;
  return (
    <Stack gap="md">
      <div role="status">{label}</div>
      <Bar value={share} aria-label={label} />
      {job && <Rows job={job} sent={writing.sent} places={places} />}
      <Group justify="flex-end">
        <Button variant="default" onClick={onClose}>
          {t("page.review.in_background")}
        </Button>
        <Button
          color="orange"
          variant="light"
          leftSection={<IconPlayerStop size={17} aria-hidden />}
          disabled={cancel.isPending || cancel.isSuccess}
          onClick={() => cancel.mutate(writing.job)}
          data-testid="write-cancel"
        >
          {t("page.review.cancel")}
        </Button>
      </Group>
    </Stack>
  );
}

export function Outcome({
  outcome,
  places,
  onClose,
  onRest,
}: Common & { outcome: Ended; onRest: () => void }) {
  const t = useTexts();
  const { changes, undo } = useStaged();
  const { job, sent } = outcome;
  const sum = summaryOf(job);
  const set = undo.find((one) => one.id === job.id);
  const whole = sum.failed === 0 && sum.waiting === 0;
  return (
    <Stack gap="md">
      <Alert
        color={whole ? "green" : "orange"}
        variant="light"
        role="status"
        data-testid={whole ? "write-verified" : "write-incomplete"}
        title={t("page.review.sum", { ...sum })}
      >
        {t(nextKey(sum))}
        {job.error && <div>{t(job.error.text_key, job.error.details)}</div>}
      </Alert>
      <Rows job={job} sent={sent} places={places} />
      <Group justify="space-between">
        <div>
          {set && (
            <Button
              variant="default"
              leftSection={<IconArrowBackUp size={17} aria-hidden />}
              onClick={() => {
                staged.undo(set);
                onRest();
              }}
              data-testid="undo"
            >
              {t("page.undo.button", { count: set.rows.length })}
            </Button>
          )}
        </div>
        <Group>
          {changes.size > 0 && (
            <Button variant="default" onClick={onRest} data-testid="review-rest">
              {t("page.review.rest", { count: changes.size })}
            </Button>
          )}
          <Button onClick={onClose} data-testid="review-close">
            {t("page.close")}
          </Button>
        </Group>
      </Group>
    </Stack>
  );
}

export interface Summary {
  saved: number;
  verified: number;
  failed: number;
  waiting: number;
}

export function summaryOf(job: Job): Summary {
  const count = (...states: JobRow["state"][]) => job.rows.filter((row) => states.includes(row.state)).length;
  return {
    saved: count("saved"),
    verified: count("verified", "unproven", "saving", "not_saved"),
    failed: count("refused") + count("not_saved"),
    waiting: count("waiting", "sent"),
  };
}

/** What to do next: the worst that happened says it. */
function nextKey(sum: Summary): string {
  if (sum.failed > 0) return "page.review.next.failed";
  if (sum.waiting > 0) return "page.review.next.cancelled";
  return sum.verified > 0 ? "page.review.next.save" : "page.review.next.prove";
}

function Rows({ job, sent, places }: { job: Job; sent: Record<string, Raw>; places: readonly Place[] }) {
  const contexts = useContexts(places);
  const nameOf = useDeviceName();
  return (
    <ol className={classes.progressRows}>
      {job.rows.map((row) => (
        <Row
          key={keyOf(row.device, row.address)}
          row={row}
          raw={sent[keyOf(row.device, row.address)] ?? null}
          context={contexts.get(row.device)}
          device={nameOf(row.device)}
        />
      ))}
    </ol>
  );
}

interface RowProps {
  row: JobRow;
  raw: Raw | null;
  context: DeviceContext | undefined;
  device: string;
}

const MARKS: Record<JobRow["state"], string> = {
  waiting: "…",
  sent: "→",
  verified: "✓",
  unproven: "?",
  saving: "→",
  saved: "◦",
  refused: "✕",
  not_saved: "✕",
};

function Row({ row, raw, context, device }: RowProps) {
  const t = useTexts();
  const entry = context && entriesOf(context.doc).get(row.address);
  const line = (value: Raw | null) =>
    value === null || !context || !entry ? "–" : lineOf(shownOf(entry, value, context));
  return (
    <li data-state={row.state} data-testid={`progress-${row.device}-${row.address}`}>
      <div className={classes.progressLine}>
        <span>{device}</span>
        <span className={classes.address}>{row.address}</span>
        <span className={classes.reviewName}>{entry ? titleOf(entry, t) : ""}</span>
        <span>
          {row.was_raw !== null && `${line(row.was_raw)} → `}
          <b>{line(raw)}</b>
        </span>
        <span className={classes.rowState}>
          <span aria-hidden>{MARKS[row.state]}</span> {t(`page.row_state.${row.state}`)}
        </span>
      </div>
      {row.error && <Why failure={row.error} device={row.device} t={t} />}
    </li>
  );
}

/** What happened, the state that the device is in now, what to do next; names and codes in the details. */
function Why({ failure, device, t }: { failure: Failure; device: string; t: Translate }) {
  const axes = useAxes();
  const node = useNodes().get(device);
  const blade = node ? [...axes.values()].find((axis) => device.startsWith(`${axis.station}/`)) : undefined;
  const state = blade?.state ?? null;
  const story = storyOf(
    new Problem({
      type: "",
      title: failure.code,
      status: 0,
      code: failure.code,
      text_key: failure.text_key,
      details: failure.details,
      device_state: state,
    }),
    t,
  );
  return (
    <div className={classes.why}>
      <div>{story.happened}</div>
      {story.state !== null && <div>{t("page.problem.state", { state: story.state })}</div>}
      <div>
        <b>{story.next}</b>
      </div>
      <details>
        <summary>{t("page.problem.details")}</summary>
        <dl>
          {story.details.map(([name, detail]) => (
            <div key={name}>
              <dt className="dim">{name}</dt>
              <dd>{detail}</dd>
            </div>
          ))}
        </dl>
      </details>
    </div>
  );
}
