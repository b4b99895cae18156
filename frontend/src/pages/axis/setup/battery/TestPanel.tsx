import { Button } from "@mantine/core";
import { IconCircleCheck, IconLock } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useEffect } from "react";
import {
  battery,
  batteryHistoryQuery,
  batteryQuery,
  type Need,
  type RunningTest,
  type TestRecord,
} from "../../../../api/battery";
import { NeedsRole } from "../../../../frame/NeedsRole";
import { figure } from "../../../../model/values";
import motion from "../../../../motion/Motion.module.css";
import { useTexts } from "../../../../texts/texts";
import { HoldButton } from "../../../../ui/HoldButton";
import { ProblemAlert } from "../../../../ui/ProblemAlert";
import { dateAndTime } from "../../../../ui/format";
import axis from "../../Axis.module.css";
import classes from "./Battery.module.css";
import { weakest } from "./blocs";
import { Course } from "./Course";

const STEPS = ["arming", "beginning", "active"] as const;
const TONES: Readonly<Record<TestRecord["verdict"], "ok" | "error" | "warning">> = {
  passed: "ok",
  failed: "error",
  refused: "warning",
  broken_off: "warning",
  unwatched: "warning",
  lost: "warning",
  timed_out: "warning",
};

/** The test of the battery: what it needs, its sequence and course, its verdict, and the tests before it. */
export function TestPanel({ slug }: { slug: string }) {
  const t = useTexts();
  const { data, error } = useQuery(batteryQuery(slug));
  const history = useQuery(batteryHistoryQuery(slug));
  const client = useQueryClient();
  const renew = () => client.invalidateQueries({ queryKey: batteryQuery(slug).queryKey });
  const begin = useMutation({ mutationFn: () => battery.test(slug), onSettled: renew });
  const cancel = useMutation({ mutationFn: () => battery.cancel(slug), onSettled: renew });
  const running = data?.running ?? null;
  const over = running === null;
  useEffect(() => {
    if (over) void client.invalidateQueries({ queryKey: batteryHistoryQuery(slug).queryKey });
  }, [over, client, slug]);
  const held = data === undefined || data.needs.some((need) => need.holds_back);
  const tests = history.data?.tests ?? [];
  const latest = tests[0];
  return (
    <section
      className={`${axis.panel} ${axis.wide}`}
      aria-label={t("page.setup.battery.test")}
      data-testid="battery-test"
    >
      <h2>{t("page.setup.battery.test")}</h2>
      <div className={classes.split}>
        <div>
          {running === null ? <Needs needs={data?.needs ?? []} /> : <Sequence running={running} />}
          <p>{t("page.setup.battery.test_effect")}</p>
          <div className={classes.row}>
            {running === null ? (
              <NeedsRole role="technician" device>
                {(locked) => (
                  <HoldButton
                    tone="danger"
                    hint={t("page.setup.battery.hold")}
                    disabled={locked || held || begin.isPending}
                    onHeld={() => begin.mutate()}
                    testId="begin-test"
                  >
                    {t("page.setup.battery.begin_test")}
                  </HoldButton>
                )}
              </NeedsRole>
            ) : (
              <Button
                variant="default"
                loading={cancel.isPending}
                onClick={() => cancel.mutate()}
                data-testid="cancel-test"
              >
                {t("page.setup.battery.cancel_test")}
              </Button>
            )}
          </div>
          {running !== null && <p className="dim">{t("page.setup.battery.cancel_note")}</p>}
          {begin.error !== null && (
            <ProblemAlert error={begin.error} title={t("page.setup.battery.test_failed")} />
          )}
          {error !== null && <ProblemAlert error={error} title={t("page.setup.battery.not_known")} />}
        </div>
        <div>
          {running !== null && <Course course={running.course} tookMs={running.took_ms} />}
          {running === null && latest !== undefined && <Verdict test={latest} />}
          {running === null && latest === undefined && (
            <p className="dim">{t("page.setup.battery.no_tests")}</p>
          )}
        </div>
      </div>
      {tests.length > 0 && <Earlier tests={tests} />}
    </section>
  );
}

function Needs({ needs }: { needs: readonly Need[] }) {
  const t = useTexts();
  return (
    <ul className={motion.locks} data-testid="needs" aria-label={t("page.setup.battery.needs")}>
      {needs.map(({ name, holds_back: bites, details }) => (
        <li key={name} data-bites={bites} data-testid={`need-${name}`}>
          {bites ? <IconLock size={17} aria-hidden /> : <IconCircleCheck size={17} aria-hidden />}
          <span>{t(`page.setup.battery.need.${name}.${bites ? "bites" : "clear"}`, details)}</span>
        </li>
      ))}
    </ul>
  );
}

function Sequence({ running }: { running: RunningTest }) {
  const t = useTexts();
  return (
    <>
      <ol className={classes.sequence} data-testid="test-sequence">
        {STEPS.map((step) => (
          <li key={step} {...(step === running.step ? { "aria-current": "step" as const } : {})}>
            {step === running.step ? "●" : "○"} {t(`page.setup.battery.step.${step}`)}
          </li>
        ))}
        <li>○ {t("page.setup.battery.step.ended")}</li>
      </ol>
      <p role="status" data-testid="test-running">
        {t("page.setup.battery.running", {
          person: running.person,
          seconds: figure(running.took_ms / 1000, 0, t.language),
        })}
      </p>
    </>
  );
}

function Verdict({ test }: { test: TestRecord }) {
  const t = useTexts();
  const low = weakest(test.course);
  return (
    <>
      <div
        className={classes.verdict}
        data-tone={TONES[test.verdict]}
        data-testid="verdict"
        data-verdict={test.verdict}
      >
        <strong className={`tone-${TONES[test.verdict]}`}>
          {t(`page.setup.battery.verdict.${test.verdict}`)}
        </strong>
        {test.lowest_v !== null && <span>{t("page.setup.battery.lowest", { volts: test.lowest_v })}</span>}
        {low !== null && (
          <span>
            {t("page.setup.battery.weakest", {
              number: low.number,
              volts: figure(low.mv / 1000, 2, t.language),
            })}
          </span>
        )}
        <span className="dim">
          {dateAndTime(test.t_ns / 1e6)} · {test.person}
        </span>
      </div>
      <p className="dim">{t(`page.setup.battery.verdict_note.${test.verdict}`)}</p>
      {test.course.length > 1 && <Course course={test.course} tookMs={test.took_ms} />}
    </>
  );
}

const plain = (value: number | null, unit: string) => (value === null ? "–" : `${value} ${unit}`);

function Earlier({ tests }: { tests: readonly TestRecord[] }) {
  const t = useTexts();
  return (
    <div className={classes.scroll} tabIndex={0} role="region" aria-label={t("page.setup.battery.earlier")}>
      <table className={axis.history} data-testid="earlier-tests">
        <caption className="visually-hidden">{t("page.setup.battery.earlier")}</caption>
        <thead>
          <tr>
            {["when", "verdict", "lowest", "weakest", "health", "off_load", "took", "who"].map((name) => (
              <th key={name} scope="col">
                {t(`page.setup.battery.column.${name}`)}
              </th>
            ))}
          </tr>
        </thead>
        <tbody>
          {tests.map((test) => {
            const low = weakest(test.course);
            return (
              <tr key={test.id}>
                <td>{dateAndTime(test.t_ns / 1e6)}</td>
                <td className={`tone-${TONES[test.verdict]}`}>
                  {t(`page.setup.battery.verdict.${test.verdict}`)}
                </td>
                <td>{plain(test.lowest_v, "V")}</td>
                <td>{low === null ? "–" : `${low.number}: ${figure(low.mv / 1000, 2, t.language)} V`}</td>
                <td>{plain(test.after.health_percent, "%")}</td>
                <td>{plain(test.before.off_load_v, "V")}</td>
                <td>{figure(test.took_ms / 1000, 1, t.language)} s</td>
                <td>{test.person}</td>
              </tr>
            );
          })}
        </tbody>
      </table>
    </div>
  );
}
