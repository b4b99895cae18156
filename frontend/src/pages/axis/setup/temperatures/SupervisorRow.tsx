import { useState } from "react";
import type { DeviceContext } from "../../../../model/shown";
import { useTexts } from "../../../../texts/texts";
import { bitState, type Temperature } from "../../../overview/layout";
import type { Edge } from "../common/bounds";
import { Findings, findingsOf } from "../common/Findings";
import { Mark } from "../common/Mark";
import { boundsOf, type Parameter, scaled, type Setup } from "../common/parameter";
import type { Scale } from "../common/scale";
import classes from "../common/Setup.module.css";
import { stopText } from "../common/stopText";
import { type Band, type Line, Track } from "../common/Track";
import { TypedValue } from "../common/TypedValue";
import { limitBounds, type MarkAt, type MarkKind, type SupervisorLane, STEP } from "./lanes";
import { Lit } from "./Lit";

const TONES = {
  lower: "cold",
  warning: "warning",
  error: "error",
  heater: "cold",
  cooler: "warm",
  fan: "warm",
} as const;
const PAGE_C = 5;

interface Props {
  lane: SupervisorLane;
  spot: Temperature;
  unit: DeviceContext | null;
  setup: Setup;
  scale: Scale;
  live: Line | null;
  raw: number | null;
}

/** Limits of one place: below the lower one and above the others the unit warns, or stops. */
export function SupervisorRow({ lane, spot, unit, setup, scale, live, raw }: Props) {
  const t = useTexts();
  const [stopped, setStopped] = useState<{ parameter: Parameter; by: Edge } | null>(null);
  const place = t(`page.temperature.${spot.key}`);
  const short = (kind: MarkKind) => t(`page.setup.temperatures.short.${kind}`);
  const kindName = (kind: MarkKind) => t(`page.setup.temperatures.mark.${kind}`);
  const look = (address: string) => setup.of(unit, address)?.raw ?? null;
  const marks = lane.marks.flatMap((mark) => {
    const parameter = setup.of(unit, mark.address);
    if (!parameter) return [];
    const bounds = boundsOf(parameter, limitBounds(lane, mark.address, look, kindName), look);
    return [{ mark, parameter, bounds, name: `${place}: ${kindName(mark.kind)} (${mark.address})` }];
  });
  return (
    <>
      <div className={classes.lane} data-testid={`lane-${lane.index}`}>
        <div className={classes.about}>
          <span>
            {t("page.setup.temperatures.supervisor")}{" "}
            <small>
              {unit?.doc.name} · {lane.index}h
            </small>
          </span>
          <Lit states={statesOf(lane, unit, raw, look)} />
        </div>
        <Track scale={scale} step={STEP} rows={2} bands={bandsOf(marks, scale, t)} lines={[live]}>
          {marks.map(({ mark, parameter, bounds, name }) => (
            <Mark
              key={mark.address}
              parameter={parameter}
              name={name}
              label={short(mark.kind)}
              scale={scale}
              bounds={bounds}
              snap={1}
              page={PAGE_C}
              tone={TONES[mark.kind]}
              row={mark.kind === "error" ? 1 : 0}
              onStopped={(by) => setStopped(by && { parameter, by })}
            />
          ))}
        </Track>
        <div className={classes.numbers}>
          {marks.map(({ mark, parameter, bounds, name }) => (
            <TypedValue
              key={mark.address}
              parameter={parameter}
              name={name}
              label={short(mark.kind)}
              bounds={bounds}
            />
          ))}
        </div>
        <p className={classes.stopped} role="status" data-testid={`stopped-${lane.index}`}>
          {stopped && stopText(stopped.parameter, stopped.by, t)}
        </p>
      </div>
      <Findings findings={findingsOf(marks.map((one) => one.parameter))} />
    </>
  );
}

interface Placed {
  mark: MarkAt;
  parameter: Parameter;
}

function bandsOf(marks: readonly Placed[], scale: Scale, t: (key: string) => string): Band[] {
  const at = (kind: MarkKind) => {
    const found = marks.find((one) => one.mark.kind === kind)?.parameter;
    return found === undefined || found.raw === null ? null : scaled(found, found.raw);
  };
  const [lower, warning, error] = [at("lower"), at("warning"), at("error")];
  const bands: (Band | null)[] = [
    lower === null
      ? null
      : {
          key: "cold",
          from: scale.low,
          to: lower,
          tone: "cold",
          title: t("page.setup.temperatures.band.cold"),
        },
    warning === null
      ? null
      : {
          key: "warning",
          from: warning,
          to: error ?? scale.high,
          tone: "warning",
          title: t("page.setup.temperatures.band.warning"),
        },
    error === null
      ? null
      : {
          key: "error",
          from: error,
          to: scale.high,
          tone: "error",
          title: t("page.setup.temperatures.band.error"),
        },
  ];
  return bands.filter((one) => one !== null);
}

/** What the unit's status says is lit (table 32); where that is not known, what follows from value and limits. */
function statesOf(
  lane: SupervisorLane,
  unit: DeviceContext | null,
  raw: number | null,
  look: (address: string) => number | null,
): string[] {
  if (unit && lane.status !== null && unit.lookup(lane.status) !== null) {
    const bits = ["lower_limit", "warning_limit", "error_limit", "sensor_short_circuit", "sensor_interrupt"];
    return bits.filter((bit) => bitState(unit, lane.status ?? "", bit)?.set);
  }
  if (raw === null) return [];
  const reached = (kind: MarkKind) => {
    const limit = lane.marks.find((one) => one.kind === kind);
    const at = limit && look(limit.address);
    return at != null && (kind === "lower" ? raw < at : raw >= at);
  };
  return (["lower", "warning", "error"] as const).filter(reached).map((kind) => `${kind}_limit`);
}
