import axis from "../../Axis.module.css";
import { useShown } from "../../../../live/live";
import { useTexts } from "../../../../texts/texts";
import { RecordedNote } from "../../RecordedNote";
import type { PictureProps } from "../SetupTab";
import classes from "./Battery.module.css";
import { BatteryFacts } from "./BatteryFacts";
import { BatteryString } from "./BatteryString";
import { ChangePanel } from "./ChangePanel";
import { ChargerPanel } from "./ChargerPanel";
import { StagedField } from "./StagedField";
import { TestPanel } from "./TestPanel";

const SETTINGS = [
  "3020:02",
  "3020:03",
  "3020:04",
  "3020:05",
  "3020:06",
  "30F1:04",
  "30F1:05",
  "30F1:06",
  "30E3",
  "3110:01",
  "3110:02",
  "3110:03",
];

/** The battery of a blade: its blocs, what it holds, its charger and settings, its test, and its change. */
export function BatteryPicture({ pmm }: PictureProps) {
  const t = useTexts();
  const { recorded } = useShown();
  if (pmm === null) return <p className="dim">{t("page.setup.battery.no_unit")}</p>;
  return (
    <div className={`${axis.panels} bench`} data-testid="battery-picture">
      <BatteryString pmm={pmm} />
      <BatteryFacts pmm={pmm} />
      <ChargerPanel pmm={pmm} />
      <section className={`${axis.panel} ${axis.plots}`} aria-label={t("page.setup.battery.settings")}>
        <h2>{t("page.setup.battery.settings")}</h2>
        <div className={classes.settings}>
          {SETTINGS.map((address) => (
            <StagedField key={address} context={pmm} address={address} />
          ))}
        </div>
      </section>
      {recorded ? <RecordedNote part="battery" /> : <TestPanel slug={pmm.slug} />}
      {!recorded && <ChangePanel slug={pmm.slug} />}
    </div>
  );
}
