import { Select } from "@mantine/core";
import { NeedsRole } from "../../../../frame/NeedsRole";
import { useDeviceVersion, useShown } from "../../../../live/live";
import { shownOf } from "../../../../model/shown";
import { useTexts } from "../../../../texts/texts";
import { stage, useChange } from "../../../parameters/staging";
import axis from "../../Axis.module.css";
import { RecordedNote } from "../../RecordedNote";
import type { PictureProps } from "../SetupTab";
import { CheckMove } from "./CheckMove";
import classes from "./Gear.module.css";
import { BLADE, entryAt, MOTOR, SENSOR } from "./sides";
import { TrainPanel } from "./TrainPanel";
import type { DeviceContext } from "../../../../model/shown";

/** Both encoders of an axis with the gears to the blade: typed as they are built, staged as the drive holds them. */
export function GearPicture({ pmc }: PictureProps) {
  const t = useTexts();
  const { recorded } = useShown();
  useDeviceVersion(pmc?.slug ?? "");
  if (pmc === null) return <p className="dim">{t("page.setup.gear.no_axis")}</p>;
  return (
    <div className={`${axis.panels} bench`} data-testid="gear-picture">
      <TrainPanel pmc={pmc} side={MOTOR} />
      <TrainPanel pmc={pmc} side={BLADE} />
      <Selection pmc={pmc} />
      {recorded ? <RecordedNote part="gear" /> : <CheckMove pmc={pmc} />}
    </div>
  );
}

/** Which encoder the position comes from. */
function Selection({ pmc }: { pmc: DeviceContext }) {
  const t = useTexts();
  const { recorded } = useShown();
  const entry = entryAt(pmc, SENSOR);
  const change = useChange(pmc.slug, SENSOR);
  if (!entry) return null;
  const now = pmc.lookup(SENSOR);
  const table = entry.enumeration === null ? undefined : pmc.doc.enumerations[entry.enumeration];
  return (
    <section className={`${axis.panel} ${axis.wide}`} aria-label={t("page.setup.gear.selection")}>
      <h2>{t("page.setup.gear.selection")}</h2>
      <div className={classes.row}>
        <span>{now === null ? "–" : shownOf(entry, now, pmc).text}</span>
        {!recorded && (
          <NeedsRole role="technician" device>
            {(locked) => (
              <Select
                aria-label={t("page.setup.gear.selection")}
                data={(table?.values ?? []).map((one) => ({
                  value: String(one.value),
                  label: t(one.text_key),
                }))}
                value={String(change?.raw ?? now ?? "")}
                onChange={(value) => value !== null && stage(entry, Number(value), [pmc])}
                disabled={locked}
                allowDeselect={false}
                w={290}
                data-testid="sensor"
              />
            )}
          </NeedsRole>
        )}
        <span className="dim">{t("page.setup.gear.selection_note")}</span>
      </div>
    </section>
  );
}
