import { IconAlertOctagon, IconAlertTriangle } from "@tabler/icons-react";
import type { ReactNode } from "react";
import { useDerived } from "../../live/live";
import type { DeviceContext } from "../../model/shown";
import { useTexts } from "../../texts/texts";
import { ReadingText } from "../../ui/ReadingText";
import { useReading, useUnheard } from "../../ui/reading";
import {
  bitState,
  LIMIT_SWITCHES,
  PMM,
  SENSOR_OPEN,
  SENSOR_SHORT,
  type Temperature,
  TEMPERATURES,
  temperatureTone,
} from "./layout";
import classes from "./Overview.module.css";

export interface Contexts {
  pmm: DeviceContext | null;
  pmc: DeviceContext | null;
}

export function Fact({ name, children }: { name: string; children: ReactNode }) {
  return (
    <div className={classes.fact}>
      <dt>{name}</dt>
      <dd>{children}</dd>
    </div>
  );
}

/** Power and temperatures of a blade, brake and limit switches. */
export function BladeFacts({ pmm, pmc }: Contexts) {
  const t = useTexts();
  return (
    <>
      <Fact name={t("page.card.battery")}>
        <ReadingText context={pmm} address="3080" pace="slow" />
        <ReadingText context={pmm} address="3060" pace="fast" />
        <ReadingText context={pmm} address="3070" pace="slow" />
      </Fact>
      <Fact name={t("page.card.charger")}>
        <Charger pmm={pmm} />
      </Fact>
      <Fact name={t("page.card.dc_link")}>
        <ReadingText context={pmm} address="3063" pace="slow" />
        <span className={classes.pair}>
          <span className="dim">{t("page.card.mains")}</span>
          <ReadingText context={pmm} address="3062" pace="slow" />
        </span>
      </Fact>
      <div className={classes.temperatures}>
        <dt className="visually-hidden">{t("page.card.temperatures")}</dt>
        <dd>
          {TEMPERATURES.map((spot) => (
            <TemperatureLine key={spot.key} spot={spot} context={spot.on === PMM ? pmm : pmc} />
          ))}
        </dd>
      </div>
      <Fact name={t("page.card.brake")}>
        <Brake pmc={pmc} />
        <LimitSwitches pmc={pmc} />
      </Fact>
    </>
  );
}

const judgedBy = ({ address, warning, error, low }: Temperature) =>
  [address, warning, error, low].filter((one) => one !== null);

function TemperatureLine({ spot, context }: { spot: Temperature; context: DeviceContext | null }) {
  const t = useTexts();
  const tone = useDerived(
    context === null ? [] : judgedBy(spot).map((address) => `value:${context.slug}/${address}`),
    () => (context ? temperatureTone(context.lookup(spot.address), spot, context.lookup) : undefined),
  );
  const Icon = tone === "error" ? IconAlertOctagon : IconAlertTriangle;
  return (
    <div className={classes.temperature}>
      <span className="dim">{t(`page.temperature.${spot.key}`)}</span>
      <span>
        {tone !== undefined && <Icon size={14} className={`tone-${tone}`} aria-hidden />}
        <ReadingText
          context={context}
          address={spot.address}
          pace={spot.pace}
          tone={tone}
          instead={(raw) => sensorWords(raw, t)}
        />
      </span>
    </div>
  );
}

export function sensorWords(raw: number, t: (key: string) => string): string | null {
  if (raw === SENSOR_OPEN) return t("page.temperature.not_connected");
  return raw === SENSOR_SHORT ? t("page.temperature.short_circuit") : null;
}

/** The stage in words: "OK" says no more than that nothing is wrong. */
function Charger({ pmm }: { pmm: DeviceContext | null }) {
  const t = useTexts();
  const reading = useReading(pmm, "3001", "rare");
  const words = (raw: number) => (raw === 1 ? t("page.card.charger_idle") : null);
  if (!reading) return <span className="dim">–</span>;
  return <ReadingText context={pmm} address="3001" pace="rare" instead={words} />;
}

function Brake({ pmc }: { pmc: DeviceContext | null }) {
  const t = useTexts();
  const words = useDerived([`value:${pmc?.slug ?? ""}/60FE:03`], () => {
    const brake = pmc && bitState(pmc, "60FE:03", "brake");
    return brake?.set == null ? null : t(brake.set ? "page.card.brake_released" : "page.card.brake_applied");
  });
  return <ReadingText context={pmc} address="60FE:03" pace="slow" instead={() => words} />;
}

function LimitSwitches({ pmc }: { pmc: DeviceContext | null }) {
  const t = useTexts();
  const reading = useReading(pmc, "60FD", "slow");
  const silent = useUnheard(pmc?.slug ?? "");
  return (
    <span className={classes.switches} role="group" aria-label={t("page.card.limit_switches")}>
      {LIMIT_SWITCHES.map(({ shown, bit, reached }) => {
        const state = pmc && bitState(pmc, "60FD", bit);
        const on = state?.set == null ? null : state.set === (reached === 1);
        const key = on === null ? "unknown" : on ? "reached" : "free";
        const words = t(`page.switch.${key}`, { at: shown, clamp: state?.bit.clamp ?? "" });
        return (
          <span
            key={bit}
            className={classes.switch}
            data-state={key}
            data-stale={silent || (reading?.stale ?? true)}
            title={words}
          >
            <span aria-hidden>{shown}</span>
            <span className="visually-hidden">{words}</span>
          </span>
        );
      })}
    </span>
  );
}
