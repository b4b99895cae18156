import type { ReactNode } from "react";
import type { SignalRun } from "../../../api/signals";
import { figure } from "../../../model/values";
import { type Translate, useTexts } from "../../../texts/texts";
import { lastOf, timeOfDay } from "../../../ui/format";
import classes from "./Signal.module.css";

const number = (value: number | null | undefined, decimals: number, unit: string, t: Translate) =>
  value === null || value === undefined ? "–" : `${figure(value, decimals, t.language)}${unit}`;

/** What the response of a run says, in figures. */
export function RunResults({ run }: { run: SignalRun }) {
  const t = useTexts();
  return (
    <div>
      <dl className={classes.facts} data-testid="signal-results">
        {rowsOf(run, t).map(([key, text]) => (
          <Row key={key} name={t(`page.signal.result.${key}`)}>
            {text}
          </Row>
        ))}
      </dl>
      <details className={classes.inForce}>
        <summary>{t("page.signal.in_force")}</summary>
        <dl className={classes.facts}>
          {run.in_force.map(({ address, name, shown, unit }) => (
            <Row key={address} name={`${address} ${t.nameOf(name)}`}>
              {unit === "" ? shown : `${shown} ${unit}`}
            </Row>
          ))}
        </dl>
      </details>
      <p className="dim">
        {t("page.signal.made", {
          device: lastOf(run.device),
          time: timeOfDay(run.t_ns / 1e6, 0),
          person: run.person,
          way: t(`page.signal.transport.${run.transport}`),
          period: run.period_ms,
          sent: run.sent,
          late: run.late,
        })}
      </p>
    </div>
  );
}

function Row({ name, children }: { name: string; children: ReactNode }) {
  return (
    <div>
      <dt>{name}</dt>
      <dd>{children}</dd>
    </div>
  );
}

function rowsOf(run: SignalRun, t: Translate): [string, string][] {
  const { sine, step, ramp, lag_ms, most_following_deg } = run.results;
  const rows: [string, string][] = [];
  if (sine)
    rows.push(
      ["ratio", number(sine.ratio, 3, "", t)],
      ["phase", number(sine.phase_deg, 1, "°", t)],
      ["delay", number(sine.delay_ms, 1, " ms", t)],
      ["rest", number(sine.rest_deg, 3, "°", t)],
    );
  if (step)
    rows.push(
      ["dead", number(step.dead_ms, 0, " ms", t)],
      ["rise", number(step.rise_ms, 0, " ms", t)],
      ["overshoot", number(step.overshoot_percent, 1, " %", t)],
      ["settling", number(step.settling_ms, 0, " ms", t)],
      ["error", number(step.error_deg, 3, "°", t)],
      ["lag", number(lag_ms, 1, " ms", t)],
    );
  if (ramp)
    rows.push(
      ["ramp_speed", number(ramp.speed_dps, 2, " °/s", t)],
      ["ramp_lag", number(ramp.lag_deg, 3, "°", t)],
      ["ramp_gain", number(ramp.gain_per_s, 1, " 1/s", t)],
    );
  rows.push(["following", number(most_following_deg, 2, "°", t)]);
  rows.push(["why", t(`motion.ended.${run.why}`)]);
  if (run.error !== null) rows.push(["failed", run.error]);
  return rows;
}
