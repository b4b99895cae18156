import { Alert, Button, Loader, Progress } from "@mantine/core";
import {
  IconArrowBackUp,
  IconCircleCheck,
  IconCircleDashed,
  IconLoader2,
  IconPlayerStop,
  IconX,
} from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { type RestoreDoc, restoreQuery } from "../../../api/restore";
import { NeedsRole } from "../../../frame/NeedsRole";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { useDeviceName } from "../../../ui/devices";
import { HoldButton } from "../../../ui/HoldButton";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { Ended } from "./Ended";
import { useStationName } from "./names";
import classes from "./Restore.module.css";
import { minutesOf, phasesOf, shareOf, type Standing } from "./run";
import { RunValues } from "./RunValues";
import { useWay } from "./ways";
import { Decision } from "./Decision";

/** One restore: while it runs, while it waits for a person, and how it ended. */
export function RestoreRun({ id }: { id: string }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const { data: doc, error } = useQuery(restoreQuery(id));
  if (!doc)
    return (
      <div className={classes.room}>
        {error ? (
          <>
            <ProblemAlert error={error} title={t("page.restoring.not_found")} />
            <p className={classes.note}>
              <Button variant="default" onClick={() => update({ restore: undefined })}>
                {t("page.restoring.to_all")}
              </Button>
            </p>
          </>
        ) : (
          <Loader m="md" aria-label={t("page.loading")} />
        )}
      </div>
    );
  return (
    <div className={classes.room} data-testid="restore-run" data-state={doc.state}>
      {doc.end === null ? <Running doc={doc} /> : <Ended doc={doc} />}
      {doc.state === "awaiting-confirmation" && <Confirmation doc={doc} />}
      {doc.switching !== null && <Switching doc={doc} device={doc.switching} />}
      <RunValues doc={doc} />
    </div>
  );
}

function Running({ doc }: { doc: RestoreDoc }) {
  const t = useTexts();
  const station = useStationName()(doc.station);
  const way = useWay(doc);
  const phases = phasesOf(doc);
  const waits = doc.state === "awaiting-confirmation";
  const label = t("page.restoring.steps_done", { done: doc.done, total: doc.total });
  return (
    <div className={classes.state}>
      <div>
        <h1 role="status" data-testid="restore-state">
          {t(`page.restoring.state.${doc.state}`, { station })}
        </h1>
        {!waits && doc.total > 0 && (
          <>
            <Progress value={shareOf(doc)} aria-label={label} mt={6} />
            <p className="dim">{label}</p>
          </>
        )}
        {phases && (
          <ol className={classes.phases} aria-label={t("page.restoring.phases")}>
            {phases.map(({ phase, standing }) => (
              <li key={phase} data-state={standing} data-testid={`phase-${phase}`}>
                <Sign standing={standing} />
                {t(`page.restoring.phase.${phase}`)}
              </li>
            ))}
          </ol>
        )}
        {doc.state === "rolling-back" && <Cause doc={doc} />}
      </div>
      {!waits && doc.can.includes("roll-back") && (
        <NeedsRole role="technician" device>
          {(locked) => (
            <Button
              color="orange"
              variant="light"
              leftSection={<IconPlayerStop size={17} aria-hidden />}
              disabled={locked || way.isPending || way.isSuccess}
              onClick={() => way.mutate("roll-back")}
              data-testid="restore-cancel"
            >
              {t("page.restoring.cancel")}
            </Button>
          )}
        </NeedsRole>
      )}
    </div>
  );
}

const SIGNS = { done: IconCircleCheck, now: IconLoader2, waiting: IconCircleDashed, failed: IconX } as const;

function Sign({ standing }: { standing: Standing }) {
  const t = useTexts();
  const Icon = SIGNS[standing];
  return (
    <>
      <Icon size={16} aria-hidden />
      <span className="visually-hidden">{t(`page.restoring.standing.${standing}`)}: </span>
    </>
  );
}

const SHORT_S = 60;

/** The new values stand in RAM: a person keeps them, or all is put back, by itself once the time is over. */
function Confirmation({ doc }: { doc: RestoreDoc }) {
  const t = useTexts();
  const station = useStationName()(doc.station);
  const leftS = doc.left_s ?? 0;
  return (
    <div className={classes.confirm} role="alert" data-testid="restore-confirm">
      <span
        className={classes.countdown}
        data-short={leftS < SHORT_S}
        data-testid="confirm-left"
        role="timer"
      >
        {minutesOf(leftS)}
      </span>
      <div>
        <strong>{t("page.restoring.confirm.title", { station })}</strong>
        <div>{t("page.restoring.confirm.explain", { station })}</div>
      </div>
      <Decision
        doc={doc}
        onward="confirm"
        label={t("page.restoring.confirm.button")}
        disabled={!doc.can.includes("confirm")}
      />
    </div>
  );
}

/** A device without a restart command: a person switches it off and on, or does without that proof. */
function Switching({ doc, device }: { doc: RestoreDoc; device: string }) {
  const t = useTexts();
  const name = useDeviceName()(device);
  const way = useWay(doc);
  return (
    <div className={classes.confirm} role="alert" data-testid="restore-switch">
      <span className={classes.countdown} data-testid="switch-left" role="timer">
        {minutesOf(doc.switch_left_s ?? 0)}
      </span>
      <div>
        <strong>{t("page.restoring.switch.title", { device: name })}</strong>
        <div>{t("page.restoring.switch.explain")}</div>
      </div>
      <NeedsRole role="technician" device>
        {(locked) => (
          <HoldButton
            tone="accent"
            hint={t("page.hold")}
            disabled={locked || way.isPending || !doc.can.includes("unproven")}
            onHeld={() => way.mutate("unproven")}
            testId="unproven-hold"
          >
            {t("page.restoring.switch.without")}
          </HoldButton>
        )}
      </NeedsRole>
    </div>
  );
}

/** Why it went another way than to the new values. */
export function Cause({ doc }: { doc: RestoreDoc }) {
  const t = useTexts();
  if (doc.cause_key === null) return null;
  const { error } = doc;
  return (
    <Alert
      color="orange"
      variant="light"
      mt={8}
      p="xs"
      icon={<IconArrowBackUp size={18} aria-hidden />}
      data-testid="restore-cause"
    >
      {t("page.restoring.because", { cause: t(doc.cause_key, doc.cause_details) })}
      {error && <div>{t(error.text_key, error.details)}</div>}
    </Alert>
  );
}
