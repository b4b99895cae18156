import { IconAlertTriangle, IconCircleCheck, IconEar, IconPlugConnectedX } from "@tabler/icons-react";
import type { ReactNode } from "react";
import { type Line, useLines } from "../../api/lines";
import { usePageSearch } from "../../frame/search";
import { useServerNow } from "../../live/live";
import { figure, rateText } from "../../model/values";
import { useTexts } from "../../texts/texts";
import { ProblemAlert } from "../../ui/ProblemAlert";
import { age } from "../../ui/format";
import { FailureAlert } from "./FailureAlert";
import classes from "./Line.module.css";
import { StationPanel } from "./StationPanel";

const NOW_MS = 500;

/** Each bus as its driver has it: how its line stands, and its stations with what is exchanged. */
export function LineView() {
  const t = useTexts();
  const [{ replay }] = usePageSearch();
  if (replay !== undefined) return <p className={classes.note}>{t("lines.live_only")}</p>;
  return <Lines />;
}

function Lines() {
  const t = useTexts();
  const { data, error } = useLines();
  if (error !== null && data === undefined) return <ProblemAlert error={error} title={t("lines.unknown")} />;
  return (
    <div className={`${classes.lines} bench`} data-testid="line-view" data-old={error !== null}>
      {(data ?? []).map((line) => (
        <OneLine key={line.bus} line={line} />
      ))}
    </div>
  );
}

const ICONS = {
  connected: IconCircleCheck,
  listening: IconEar,
  lost: IconAlertTriangle,
  closed: IconPlugConnectedX,
};
const TONES = { connected: "ok", listening: "warning", lost: "error", closed: "error" };

function OneLine({ line }: { line: Line }) {
  const t = useTexts();
  const nowMs = useServerNow(NOW_MS);
  const Icon = ICONS[line.state];
  return (
    <section className={classes.line} aria-label={line.bus} data-testid={`line-${line.bus}`}>
      <header>
        <h2>
          {line.bus} <small>{t(`lines.kind.${line.kind}`)}</small>
        </h2>
        <strong className={`tone-${TONES[line.state]}`} data-testid="line-state">
          <Icon size={16} aria-hidden /> {t(`lines.state.${line.state}`)}
        </strong>
        <span className="dim">
          {t("lines.since", { age: age(nowMs - line.since_t_ns / 1e6, t.language) })}
        </span>
      </header>
      <dl className={classes.facts}>
        <Fact name={t("lines.fact.connection")}>{line.connection}</Fact>
        <Fact name={t("lines.fact.bitrate")}>
          {line.bitrate > 0 ? `${rateText(line.bitrate, t.language)} kbit/s` : "–"}
        </Fact>
        {line.master !== null && <Fact name={t("lines.fact.master")}>{line.master}</Fact>}
        <Fact name={t("lines.fact.load")}>{`${figure(line.load * 100, 1, t.language)} %`}</Fact>
        <Fact name={t("lines.fact.frames")}>{line.frames}</Fact>
        <Fact name={t("lines.fact.reconnects")}>{line.reconnects}</Fact>
        {line.dropped > 0 && <Fact name={t("lines.fact.dropped")}>{line.dropped}</Fact>}
      </dl>
      {line.problem !== null && <FailureAlert failure={line.problem} title={t("lines.not_open")} />}
      {line.problem === null && line.reason !== "" && <p className="tone-error">{line.reason}</p>}
      {line.stations.map((station) => (
        <StationPanel key={station.device} station={station} master={line.master} />
      ))}
    </section>
  );
}

export function Fact({ name, children }: { name: string; children: ReactNode }) {
  return (
    <div>
      <dt>{name}</dt>
      <dd>{children}</dd>
    </div>
  );
}
