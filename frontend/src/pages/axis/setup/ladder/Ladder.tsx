import { useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { rulesQuery } from "../../../../api/rules";
import { figure } from "../../../../model/values";
import { type Translate, useTexts } from "../../../../texts/texts";
import { type Reading, useReading } from "../../../../ui/reading";
import type { Edge } from "../common/bounds";
import { Findings, findingsOf } from "../common/Findings";
import { Mark } from "../common/Mark";
import { boundsOf, type Parameter, type Setup, useSetup } from "../common/parameter";
import { ReadNow } from "../common/ReadNow";
import { type Scale, scaleFor } from "../common/scale";
import classes from "../common/Setup.module.css";
import { stopText } from "../common/stopText";
import { type Line, Ticks, Track } from "../common/Track";
import { TypedValue } from "../common/TypedValue";
import type { PictureProps } from "../SetupTab";
import { belowBattery, BLOC_MV, BLOCS, type Look, type Step, stepBounds, stepsOf, zoneOf } from "./ladder";
import { Voltages } from "./Voltages";

const USUAL: Scale = { low: 0, high: 900 };
const GRID_V = 100;
const PAGE_V = 10;
const MILLI = 1000;

/** The voltages of table 19 to scale, from the PMC's greatest down to its least; none can be moved past its neighbour. */
export function Ladder({ pmm, pmc }: PictureProps) {
  const t = useTexts();
  const setup = useSetup(pmm, pmc);
  const steps = stepsOf(useQuery(rulesQuery).data ?? []);
  const unitOf = (step: Step) => (step.on === "pmm" ? pmm : pmc);
  const of = (step: Step) => setup.of(unitOf(step), step.address);
  const look: Look = (step) => of(step)?.raw ?? null;
  const lines = useLines(setup, pmm, pmc);
  const values = [...steps.map(look), ...lines.map((one) => one?.at)].filter((one) => one != null);
  const scale = scaleFor(USUAL, values, GRID_V);
  const addresses = (on: Step["on"]) => steps.filter((one) => one.on === on).map((one) => one.address);
  const live = lines.find((one) => one?.key === "3063");
  return (
    <section
      className={classes.picture}
      aria-label={t("page.setup.picture.ladder")}
      data-testid="picture-ladder"
    >
      <p className={classes.intro}>{t("page.setup.ladder.intro")}</p>
      <ReadNow device={pmm} addresses={[...addresses("pmm"), BLOCS, BLOC_MV]} />
      <ReadNow device={pmc} addresses={addresses("pmc")} />
      <Voltages lines={lines} />
      {live && <Zone steps={steps} voltage={live.at} look={look} />}
      <div className={classes.steps}>
        <div className={classes.lane} data-head>
          <span />
          <Ticks scale={scale} step={GRID_V} unit="V" />
          <span />
        </div>
        {[...steps.keys()].reverse().map((at) => (
          <StepRow
            key={at}
            steps={steps}
            at={at}
            setup={setup}
            pmm={pmm}
            pmc={pmc}
            scale={scale}
            lines={lines}
          />
        ))}
      </div>
      <Findings findings={findingsOf(steps.map(of))} />
    </section>
  );
}

const keyOf = (step: Step): string => step.address.replace(":", "_");
const nameOf = (step: Step, t: Translate): string => t(`page.setup.ladder.step.${keyOf(step)}`);

interface RowProps extends Pick<PictureProps, "pmm" | "pmc"> {
  steps: readonly Step[];
  at: number;
  setup: Setup;
  scale: Scale;
  lines: readonly (Line | null)[];
}

function StepRow({ steps, at, setup, pmm, pmc, scale, lines }: RowProps) {
  const t = useTexts();
  const [stopped, setStopped] = useState<{ parameter: Parameter; by: Edge } | null>(null);
  const step = steps[at];
  const of = (one: Step) => setup.of(one.on === "pmm" ? pmm : pmc, one.address);
  const look: Look = (one) => of(one)?.raw ?? null;
  const parameter = step && of(step);
  if (!step || !parameter) return null;
  const own = stepBounds(steps, at, look, (one) => nameOf(one, t));
  const bounds = boundsOf(
    parameter,
    at === 0 ? belowBattery(own, batteryOf(setup, pmm), t("page.setup.ladder.line.battery")) : own,
    (address) => setup.of(parameter.context, address)?.raw ?? null,
  );
  const name = `${nameOf(step, t)} (${step.address})`;
  const room = {
    key: "room",
    from: bounds.low?.raw ?? scale.low,
    to: bounds.high?.raw ?? scale.high,
    tone: "room" as const,
    title: t("page.setup.ladder.room"),
  };
  return (
    <>
      <div className={classes.lane} data-testid={`lane-${step.address}`}>
        <div className={classes.about}>
          <span>
            {nameOf(step, t)}{" "}
            <small>
              {parameter.context.doc.name} · {step.address}
            </small>
          </span>
          <small className={classes.does}>{t(`page.setup.ladder.does.${keyOf(step)}`)}</small>
        </div>
        <Track scale={scale} step={GRID_V} rows={1} bands={[room]} lines={lines}>
          <Mark
            parameter={parameter}
            name={name}
            label=""
            scale={scale}
            bounds={bounds}
            snap={1}
            page={PAGE_V}
            tone={at === 0 || at >= steps.length - 2 || at === 1 ? "error" : "plain"}
            onStopped={(by) => setStopped(by && { parameter, by })}
          />
        </Track>
        <div className={classes.numbers}>
          <TypedValue
            parameter={parameter}
            name={name}

            bounds={bounds}
          />
        </div>
        <p className={classes.stopped} role="status" data-testid={`stopped-${step.address}`}>
          {stopped && stopText(stopped.parameter, stopped.by, t)}
        </p>
      </div>
    </>
  );
}

/** Nominal voltage of all blocs in V; null where it is not known. */
function batteryOf(setup: Setup, pmm: PictureProps["pmm"]): number | null {
  const [blocs, bloc] = [setup.of(pmm, BLOCS)?.raw ?? null, setup.of(pmm, BLOC_MV)?.raw ?? null];
  return blocs === null || bloc === null ? null : (blocs * bloc) / MILLI;
}

/** What is measured, and what it is measured against: both units' DC link, the peak of the mains, the battery. */
function useLines(setup: Setup, pmm: PictureProps["pmm"], pmc: PictureProps["pmc"]): (Line | null)[] {
  const t = useTexts();
  const line = (key: string, reading: Reading | null, factor: number, kind: Line["kind"]): Line | null => {
    if (reading === null || typeof reading.raw !== "number") return null;
    const at = reading.raw * factor;
    return { key, at, stale: reading.stale, kind, title: titleOf(key, at, t) };
  };
  const battery = batteryOf(setup, pmm);
  return [
    line("3063", useReading(pmm, "3063", "slow"), 1, "live"),
    line("6079", useReading(pmc, "6079", "slow"), 1 / MILLI, "live"),
    line("mains", useReading(pmm, "3062", "slow"), Math.SQRT2, "reference"),
    battery === null
      ? null
      : {
          key: "battery",
          at: battery,
          stale: false,
          kind: "reference",
          title: titleOf("battery", battery, t),
        },
  ];
}

const titleOf = (key: string, at: number, t: Translate): string =>
  `${t(`page.setup.ladder.line.${key}`)}: ${figure(at, 0, t.language)} V`;

/** Where the DC link stands in its order, in words. */
function Zone({ steps, voltage, look }: { steps: readonly Step[]; voltage: number; look: Look }) {
  const t = useTexts();
  const { below, above } = zoneOf(steps, voltage, look);
  const name = (step: Step | null) => (step === null ? "–" : nameOf(step, t));
  return (
    <p className={classes.zone} data-testid="ladder-zone">
      {t("page.setup.ladder.zone", {
        voltage: figure(voltage, 0, t.language),
        below: name(below),
        above: name(above),
      })}
    </p>
  );
}
