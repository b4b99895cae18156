import { Button } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { runsQuery, type SignalLine } from "../../../api/signals";
import { figure } from "../../../model/values";
import { type Translate, useTexts } from "../../../texts/texts";
import { dateAndTime } from "../../../ui/format";
import { nameOf } from "./settings";
import classes from "./Signal.module.css";

interface Props {
  device: string;
  shown: string | undefined;
  over: string | undefined;
  onShow: (id: string | undefined) => void;
  onOver: (id: string | undefined) => void;
}

/** The runs of an axis, newest first: one is shown, another one can be laid over it. */
export function RunList({ device, shown, over, onShow, onOver }: Props) {
  const t = useTexts();
  const runs = useQuery(runsQuery(device)).data ?? [];
  if (runs.length === 0) return <p className="dim">{t("page.signal.none")}</p>;
  return (
    <div className={classes.runs} tabIndex={0} role="region" aria-label={t("page.signal.runs")}>
      <table data-testid="signal-runs">
        <thead>
          <tr>
            {["when", "signal", "result", "ended", "person"].map((key) => (
              <th key={key} scope="col">
                {t(`page.signal.column.${key}`)}
              </th>
            ))}
            <th aria-label={t("page.signal.column.actions")} />
          </tr>
        </thead>
        <tbody>
          {runs.map((run) => (
            <tr key={run.id} data-shown={run.id === shown}>
              <td>{dateAndTime(run.t_ns / 1e6)}</td>
              <td>{nameOf(run, t)}</td>
              <td>{resultOf(run, t)}</td>
              <td>{t(`motion.ended.${run.why}`)}</td>
              <td>{run.person}</td>
              <td>
                <Button
                  variant="subtle"
                  h={40}
                  aria-pressed={run.id === shown}
                  onClick={() => onShow(run.id === shown ? undefined : run.id)}
                >
                  {t(run.id === shown ? "page.signal.shown" : "page.signal.show")}
                </Button>
                <Button
                  variant="subtle"
                  h={40}
                  disabled={shown === undefined || run.id === shown}
                  aria-pressed={run.id === over}
                  onClick={() => onOver(run.id === over ? undefined : run.id)}
                  data-testid="lay-over"
                >
                  {t(run.id === over ? "page.signal.take_off" : "page.signal.lay_over")}
                </Button>
              </td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}

function resultOf({ results }: SignalLine, t: Translate): string {
  const { sine, step, ramp } = results;
  const part = (key: string, value: number, decimals: number) =>
    t(`page.signal.short.${key}`, { value: figure(value, decimals, t.language) });
  if (sine) return part("sine", sine.delay_ms, 1);
  if (step) return part("step", step.overshoot_percent, 1);
  if (ramp) return part("ramp", ramp.lag_deg, 3);
  return "–";
}
