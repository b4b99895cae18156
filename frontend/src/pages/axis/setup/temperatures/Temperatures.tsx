import { useReading } from "../../../../ui/reading";
import { useTexts } from "../../../../texts/texts";
import { ReadingText } from "../../../../ui/ReadingText";
import { sensorWords } from "../../../overview/BladeFacts";
import { PMC, temperatureTone } from "../../../overview/layout";
import { ReadNow } from "../common/ReadNow";
import classes from "../common/Setup.module.css";
import { scaled, type Setup, useSetup } from "../common/parameter";
import { type Scale, scaleFor } from "../common/scale";
import { type Line, Ticks } from "../common/Track";
import type { PictureProps } from "../SetupTab";
import { ControllerRow } from "./ControllerRow";
import { addressesOf, measured, type Spot, SPOTS, STEP } from "./lanes";
import { SupervisorRow } from "./SupervisorRow";

const USUAL: Scale = { low: -40, high: 160 };

/** Limits and controllers of all temperatures on one scale, with what is measured now; what is moved is staged. */
export function Temperatures({ pmm, pmc }: PictureProps) {
  const t = useTexts();
  const setup = useSetup(pmm, pmc);
  const scale = scaleFor(USUAL, valuesOf(setup, pmm, pmc), STEP);
  return (
    <section
      className={classes.picture}
      aria-label={t("page.setup.picture.temperatures")}
      data-testid="picture-temperatures"
    >
      <p className={classes.intro}>{t("page.setup.temperatures.intro")}</p>
      <ReadNow device={pmm} addresses={addressesOf("pmm")} />
      <ReadNow device={pmc} addresses={addressesOf("pmc")} />
      <div className={classes.lane} data-head>
        <span />
        <Ticks scale={scale} step={STEP} unit="°C" />
        <span />
      </div>
      {SPOTS.map((spot) => (
        <Place key={spot.spot.key} spot={spot} setup={setup} pmm={pmm} pmc={pmc} scale={scale} />
      ))}
    </section>
  );
}

type Units = Pick<PictureProps, "pmm" | "pmc">;

/** Every mark there is: the scale holds them all. */
function valuesOf(setup: Setup, pmm: Units["pmm"], pmc: Units["pmc"]): number[] {
  const lanes = SPOTS.flatMap((one) => one.lanes);
  return lanes.flatMap((lane) => {
    const unit = lane.on === "pmm" ? pmm : pmc;
    const addresses =
      lane.kind === "supervisor"
        ? lane.marks.map((one) => one.address)
        : [lane.heater, lane.cooler].filter((one) => one !== null);
    return addresses.flatMap((address) => {
      const parameter = setup.of(unit, address);
      return parameter?.raw == null ? [] : [scaled(parameter, parameter.raw)];
    });
  });
}

interface PlaceProps extends Units {
  spot: Spot;
  setup: Setup;
  scale: Scale;
}

/** One sensor: what it measures, and the lanes of what looks after it. */
function Place({ spot: { spot, lanes }, setup, pmm, pmc, scale }: PlaceProps) {
  const t = useTexts();
  const unit = spot.on === PMC ? pmc : pmm;
  const reading = useReading(unit, spot.address, spot.pace);
  const raw = measured(reading?.raw);
  const live: Line | null =
    reading === null || raw === null
      ? null
      : { key: spot.key, at: raw / 10, stale: reading.stale, kind: "live", title: `${reading.text} °C` };
  const tone = temperatureTone(raw, spot, (address) => setup.of(unit, address)?.ram ?? null);
  const name = t(`page.temperature.${spot.key}`);
  return (
    <section className={classes.place} aria-label={name} data-testid={`place-${spot.key}`}>
      <h2>
        {name}
        <span className={classes.now}>
          <ReadingText
            context={unit}
            address={spot.address}
            pace={spot.pace}
            tone={tone}
            instead={(one) => sensorWords(one, t)}
          />
        </span>
      </h2>
      {lanes.map((lane) =>
        lane.kind === "supervisor" ? (
          <SupervisorRow
            key={lane.index}
            lane={lane}
            spot={spot}
            unit={lane.on === "pmm" ? pmm : pmc}
            setup={setup}
            scale={scale}
            live={live}
            raw={raw}
          />
        ) : (
          <ControllerRow
            key={lane.index}
            lane={lane}
            spot={spot}
            unit={pmm}
            setup={setup}
            scale={scale}
            live={live}
          />
        ),
      )}
    </section>
  );
}
