import { IconAlertTriangle, IconCircleCheck, IconLoader, IconQuestionMark } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import type { Diagnosis, LineStation } from "../../api/lines";
import { useTurbineQuery } from "../../api/queries";
import { useWatchDevice } from "../../live/live";
import { useTexts } from "../../texts/texts";
import { placesOf, useDeviceName } from "../../ui/devices";
import { useDeviceContext } from "../../ui/reading";
import { age, errorCode } from "../../ui/format";
import { FailureAlert } from "./FailureAlert";
import classes from "./Line.module.css";
import { Fact } from "./LineView";
import { OrderPanel } from "./OrderPanel";
import { TelegramTables } from "./TelegramTables";

const ICONS = { exchanging: IconCircleCheck, starting: IconLoader, absent: IconAlertTriangle };
const TONES = { exchanging: "ok", starting: "warning", absent: "error" };

interface Props {
  station: LineStation;
  /** Our own address on the line. */
  master: number | null;
}

/** One station: where it stands, what its diagnosis says, and its process data word by word. */
export function StationPanel({ station, master }: Props) {
  const t = useTexts();
  const nameOf = useDeviceName();
  const turbine = useQuery(useTurbineQuery()).data;
  const device = placesOf(turbine).find((one) => one.device.slug === station.device)?.device;
  const context = useDeviceContext(device);
  useWatchDevice(station.device); // units of process data rest on other parameters
  const { state, telegram } = station;
  const Icon = state === null ? IconQuestionMark : ICONS[state];
  return (
    <section
      className={classes.station}
      aria-label={nameOf(station.device)}
      data-testid={`station-${String(station.node)}`}
    >
      <header>
        <h3>
          {nameOf(station.device)} <small>{t("lines.address", { node: station.node })}</small>
        </h3>
        <strong className={state === null ? "dim" : `tone-${TONES[state]}`} data-testid="station-state">
          <Icon size={16} aria-hidden /> {t(`lines.station.${state ?? "unknown"}`)}
        </strong>
        {state === "exchanging" && (
          <span className={station.stale ? "tone-warning" : "dim"} data-testid="station-age">
            {station.age_ms === null
              ? t("lines.no_inputs")
              : t("lines.inputs_age", { age: age(station.age_ms, t.language) })}
          </span>
        )}
      </header>
      {station.problem !== null && <FailureAlert failure={station.problem} title={t("lines.not_run")} />}
      <dl className={classes.facts}>
        <Fact name={t("lines.fact.dp_state")}>
          <span data-testid="dp-state">
            {station.dp_state === null ? "–" : t(`lines.dp.${station.dp_state}`)}
          </span>
        </Fact>
        <Fact name={t("lines.fact.watchdog")}>
          <span data-testid="watchdog-state">
            {station.watchdog_state === null ? "–" : t(`lines.watchdog.${station.watchdog_state}`)}
          </span>
        </Fact>
        <Fact name={t("lines.fact.telegram")}>
          {telegram === null || state !== "exchanging"
            ? "–"
            : t(telegram.has_pkw ? "lines.telegram.with_pkw" : "lines.telegram.plain", { ...telegram })}
        </Fact>
        <Fact name={t("lines.fact.starts")}>{state === null ? "–" : station.starts}</Fact>
        <DiagnosisFacts diagnosis={station.diagnosis} master={master} />
      </dl>
      {state === "exchanging" && telegram !== null && (
        <>
          <TelegramTables telegram={telegram} stale={station.stale} context={context} />
          <OrderPanel station={station} context={context} />
        </>
      )}
    </section>
  );
}

/** The latest Slave_Diag in words, its bytes beside them. */
function DiagnosisFacts({ diagnosis, master }: { diagnosis: Diagnosis | null; master: number | null }) {
  const t = useTexts();
  if (diagnosis === null) return <Fact name={t("lines.fact.diagnosis")}>–</Fact>;
  const ours = diagnosis.master !== null && diagnosis.master === master;
  const words = [
    ...diagnosis.status.map((key) => t(key)),
    ...diagnosis.blocks.map((block) => t(block.text_key, block.details)),
  ];
  return (
    <>
      <Fact name={t("lines.fact.ident")}>{errorCode(diagnosis.ident)}</Fact>
      <Fact name={t("lines.fact.owner")}>
        {diagnosis.master === null
          ? t("lines.owner.none")
          : t(ours ? "lines.owner.ours" : "lines.owner.other", { master: diagnosis.master })}
      </Fact>
      <div className={classes.wide} data-testid="diagnosis">
        <dt>{t("lines.fact.diagnosis")}</dt>
        <dd>
          <code>{diagnosis.data}</code> {words.length === 0 ? t("lines.status.none") : words.join(" · ")}
        </dd>
      </div>
    </>
  );
}
