import { Alert, Button, Progress } from "@mantine/core";
import { IconAlertOctagon, IconBug, IconCircleCheck, IconPlayerStop, IconX } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { faultKindsQuery, type InjectedFault, instructing, type Playing } from "../../api/instructor";
import type { InstructorData } from "../../api/types";
import { NeedsRole } from "../../frame/NeedsRole";
import { useServerNow } from "../../live/live";
import { type Translate, useTexts } from "../../texts/texts";
import { age, clock } from "../../ui/format";
import { notify } from "../../ui/notices";
import { storyOf } from "../../ui/problem";
import classes from "./Instructor.module.css";
import { scenarioTitle, useWhere, valuesText } from "./names";

const SECOND_MS = 1000;
const NEW_MS = 3000;

/** What acts in the twins now, always in sight, and the way to end it. */
export function ActiveFaults({ line }: { line: InstructorData }) {
  const t = useTexts();
  const nowMs = useServerNow(SECOND_MS);
  const clearAll = useTold(instructing.clearAll, t("page.instructor.clear_failed"));
  const { faults, playing, answering } = line;
  return (
    <section className={classes.active} aria-label={t("page.instructor.active")} data-testid="active-faults">
      {!answering && (
        <Alert
          color="red"
          variant="light"
          icon={<IconAlertOctagon aria-hidden />}
          title={t("page.instructor.silent")}
          data-testid="twins-silent"
        >
          {t("page.instructor.silent_next")}
        </Alert>
      )}
      {playing && <PlayingStrip playing={playing} nowMs={nowMs} />}
      <div className={classes.activeHead}>
        {faults.length === 0 ? (
          <span className={classes.healthy} role="status" data-testid="no-fault">
            <IconCircleCheck size={19} className="tone-ok" aria-hidden />
            {t("page.instructor.none")}
          </span>
        ) : (
          <>
            <h2 role="status">
              <IconBug size={19} aria-hidden />
              {t(faults.length === 1 ? "page.instructor.mark_one" : "page.instructor.mark", {
                count: faults.length,
              })}
            </h2>
            <NeedsRole role="technician" device>
              {(locked) => (
                <Button
                  variant="default"
                  disabled={locked || clearAll.isPending}
                  onClick={() => clearAll.mutate()}
                  data-testid="clear-all"
                >
                  {t("page.instructor.clear_all")}
                </Button>
              )}
            </NeedsRole>
          </>
        )}
      </div>
      {faults.length > 0 && (
        <ul className={classes.faults}>
          {faults.map((fault) => (
            <FaultRow key={fault.id} fault={fault} nowMs={nowMs} />
          ))}
        </ul>
      )}
    </section>
  );
}

function FaultRow({ fault, nowMs }: { fault: InjectedFault; nowMs: number }) {
  const t = useTexts();
  const where = useWhere();
  const kind = useQuery(faultKindsQuery).data?.find((one) => one.id === fault.kind);
  const clear = useTold(instructing.clear, t("page.instructor.clear_failed"));
  const sinceMs = nowMs - fault.since_ns / 1e6;
  const name = t(`fault.${fault.kind}.name`);
  const place = where(fault, kind?.target === "bus");
  return (
    <li data-new={sinceMs < NEW_MS} data-testid={`fault-${fault.kind}`}>
      <div className={classes.what}>
        <strong>{name}</strong>
        <span className="dim">{valuesText(fault, kind?.parameters ?? [], t)}</span>
      </div>
      <span className={classes.where}>{place}</span>
      <span className={classes.age}>{t("page.instructor.since", { age: age(sinceMs, t.language) })}</span>
      <span className={classes.age}>{endText(fault, kind?.momentary ?? false, nowMs, t)}</span>
      <NeedsRole role="technician" device>
        {(locked) => (
          <Button
            variant="default"
            leftSection={<IconX size={17} aria-hidden />}
            aria-label={t("page.instructor.clear_one", { fault: name, place })}
            disabled={locked || clear.isPending}
            onClick={() => clear.mutate(fault.id)}
          >
            {t("page.instructor.clear")}
          </Button>
        )}
      </NeedsRole>
    </li>
  );
}

function endText(fault: InjectedFault, momentary: boolean, nowMs: number, t: Translate): string {
  if (fault.until_ns !== null) {
    return t("page.instructor.left", { age: age(fault.until_ns / 1e6 - nowMs, t.language) });
  }
  return t(momentary ? "page.instructor.ends_itself" : "page.instructor.until_cleared");
}

function PlayingStrip({ playing, nowMs }: { playing: Playing; nowMs: number }) {
  const t = useTexts();
  const stop = useTold(instructing.stop, t("page.instructor.stop_failed"));
  const wholeMs = (playing.until_ns - playing.since_ns) / 1e6;
  const doneMs = Math.min(wholeMs, Math.max(0, nowMs - playing.since_ns / 1e6));
  const title = scenarioTitle(playing.scenario, playing.title, t);
  return (
    <div className={classes.playing} data-testid="playing">
      <strong>{t("page.instructor.plays", { title })}</strong>
      <Progress
        className={classes.progress ?? ""}
        value={wholeMs === 0 ? 0 : (100 * doneMs) / wholeMs}
        color="var(--hs-twin)"
        size="lg"
        aria-label={t("page.instructor.progress")}
      />
      <span className={classes.clock}>
        {clock(doneMs)} / {clock(wholeMs)}
      </span>
      <NeedsRole role="technician" device>
        {(locked) => (
          <Button
            variant="default"
            leftSection={<IconPlayerStop size={17} aria-hidden />}
            disabled={locked || stop.isPending}
            onClick={() => stop.mutate()}
            data-testid="stop-scenario"
          >
            {t("page.instructor.stop")}
          </Button>
        )}
      </NeedsRole>
    </div>
  );
}

/** A command whose failure is told; its success is seen, because the socket tells what acts. */
function useTold<Input>(run: (input: Input) => Promise<unknown>, title: string) {
  const t = useTexts();
  return useMutation({
    mutationFn: run,
    onError: (error) => {
      const story = storyOf(error, t);
      notify({ tone: "error", title, lines: [story.happened, story.next] });
    },
  });
}
