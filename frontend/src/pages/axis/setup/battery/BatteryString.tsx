import type { DeviceContext } from "../../../../model/shown";
import { figure } from "../../../../model/values";
import { useDeviceVersion } from "../../../../live/live";
import { useTexts } from "../../../../texts/texts";
import { ReadingText } from "../../../../ui/ReadingText";
import { useReading } from "../../../../ui/reading";
import axis from "../../Axis.module.css";
import classes from "./Battery.module.css";
import { type Bloc, type BlocReading, blocsOf, flowOf, NO_SENSOR } from "./blocs";

const MOST_BLOCS = 8;
const NO_BLOCS: readonly BlocReading[] = [];

function number(context: DeviceContext, address: string): number | null {
  const raw = context.lookup(address);
  return typeof raw === "number" ? raw : null;
}

function readingsOf(pmm: DeviceContext): readonly BlocReading[] {
  const count = Math.min(number(pmm, "3020:04") ?? 0, MOST_BLOCS);
  if (count <= 0) return NO_BLOCS;
  return Array.from({ length: count }, (_, at) => ({
    number: at + 1,
    mv: number(pmm, `3061:0${at + 1}`),
    tenthsC: number(pmm, `301F:0${at + 1}`),
  }));
}

/** The blocs in series with voltage and temperature of each, and the current through all of them in words. */
export function BatteryString({ pmm }: { pmm: DeviceContext }) {
  const t = useTexts();
  useDeviceVersion(pmm.slug);
  const current = useReading(pmm, "3070", "slow");
  const stale = useReading(pmm, "3061:01", "rare")?.stale ?? true;
  const blocs = blocsOf(readingsOf(pmm), number(pmm, "3020:05") ?? 0, number(pmm, "3020:06") ?? 0);
  const currentMa = typeof current?.raw === "number" ? current.raw : null;
  const flow = flowOf(currentMa);
  return (
    <section className={`${axis.panel} ${axis.wide}`} aria-label={t("page.setup.battery.string")}>
      <h2>
        {t("page.setup.battery.string")}
        <ReadingText context={pmm} address="3060" pace="fast" />
      </h2>
      <ol className={classes.string} data-stale={stale} data-testid="blocs">
        {blocs.map((bloc) => (
          <li key={bloc.number}>
            <BlocBox bloc={bloc} stale={stale} />
          </li>
        ))}
      </ol>
      {blocs.length === 0 && <p className="dim">{t("page.setup.battery.no_blocs")}</p>}
      <div className={classes.flow}>
        <span data-testid="flow">
          <strong>{t(`page.setup.battery.flow.${flow}`)}</strong>
          <ReadingText context={pmm} address="3070" pace="slow" />
          <span className="dim">{t(`page.setup.battery.flow_note.${flow}`)}</span>
        </span>
        <span>
          <span className="dim">{t("page.setup.battery.temperature")}</span>
          <ReadingText context={pmm} address="3010" pace="slow" />
        </span>
      </div>
    </section>
  );
}

function BlocBox({ bloc, stale }: { bloc: Bloc; stale: boolean }) {
  const t = useTexts();
  const mark = bloc.least ? "least" : bloc.greatest ? "greatest" : "none";
  return (
    <div
      className={classes.bloc}
      data-mark={mark}
      data-testid={`bloc-${bloc.number}`}
      style={{ "--fill": bloc.fill ?? 0 } as React.CSSProperties}
    >
      <i className={classes.level} aria-hidden />
      <span className="dim">{t("page.setup.battery.bloc", { number: bloc.number })}</span>
      <span className={stale ? "dim" : undefined}>
        <strong>{bloc.mv === null ? "–" : figure(bloc.mv / 1000, 2, t.language)}</strong> V
      </span>
      <span>
        {bloc.tenthsC === null || bloc.tenthsC === NO_SENSOR
          ? t("page.setup.battery.no_temperature")
          : `${figure(bloc.tenthsC / 10, 1, t.language)} °C`}
      </span>
      <span className={classes.mark}>
        {bloc.least && `▼ ${t("page.setup.battery.least")}`}
        {bloc.greatest && `▲ ${t("page.setup.battery.greatest")}`}
      </span>
    </div>
  );
}
