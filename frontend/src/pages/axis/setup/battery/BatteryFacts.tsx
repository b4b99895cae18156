import type { DeviceContext } from "../../../../model/shown";
import { useTexts } from "../../../../texts/texts";
import { ReadingText } from "../../../../ui/ReadingText";
import { useReading } from "../../../../ui/reading";
import axis from "../../Axis.module.css";
import classes from "./Battery.module.css";

const FACTS = [
  ["charge", "3080", "slow"],
  ["capacity", "3053", "rare"],
  ["health", "3081", "rare"],
  ["resistance", "30B4", "rare"],
  ["off_load", "3067", "rare"],
  ["charged_total", "3050", "rare"],
  ["lowest_test", "3068", "rare"],
] as const;

/** How full and how worn it is. */
export function BatteryFacts({ pmm }: { pmm: DeviceContext }) {
  const t = useTexts();
  const charge = useReading(pmm, "3080", "slow");
  const percent = typeof charge?.raw === "number" ? charge.raw : null;
  return (
    <section className={axis.panel} aria-label={t("page.setup.battery.facts")}>
      <h2>{t("page.setup.battery.facts")}</h2>
      <div
        className={classes.meter}
        role="meter"
        aria-label={t("page.setup.battery.charge")}
        aria-valuemin={0}
        aria-valuemax={100}
        aria-valuenow={percent ?? 0}
        aria-valuetext={percent === null ? "–" : `${percent} %`}
      >
        <span style={{ width: `${percent ?? 0}%` }} />
      </div>
      <dl className={classes.facts}>
        {FACTS.map(([name, address, pace]) => (
          <Fact key={name} name={t(`page.setup.battery.${name}`)}>
            <ReadingText context={pmm} address={address} pace={pace} />
          </Fact>
        ))}
      </dl>
      <p className="dim">{t("page.setup.battery.health_note")}</p>
    </section>
  );
}

export function Fact({ name, children }: { name: string; children: React.ReactNode }) {
  return (
    <>
      <dt>{name}</dt>
      <dd>{children}</dd>
    </>
  );
}
