import { useQuery } from "@tanstack/react-query";
import { rulesQuery } from "../../../../api/rules";
import { useTexts } from "../../../../texts/texts";
import { useSetup } from "../common/parameter";
import { ReadNow } from "../common/ReadNow";
import setupClasses from "../common/Setup.module.css";
import type { PictureProps } from "../SetupTab";
import { ALARMS, AlarmInputs } from "./AlarmInputs";
import { columnsOf } from "./matrix";
import { OutputMatrix } from "./OutputMatrix";
import { PositionRange, RANGE } from "./PositionRange";
import { PULSE_WIDTH, PulseTest } from "./PulseTest";

/** Who drives which output, which input raises which alarm, and what the inputs say now. */
export function Masks({ pmm, pmc }: PictureProps) {
  const t = useTexts();
  const setup = useSetup(pmm, pmc);
  const columns = columnsOf(useQuery(rulesQuery).data ?? []);
  return (
    <section
      className={setupClasses.picture}
      aria-label={t("page.setup.picture.masks")}
      data-testid="picture-masks"
    >
      <ReadNow device={pmm} addresses={[...columns, ...ALARMS, ...RANGE, PULSE_WIDTH]} />
      {pmm && <OutputMatrix unit={pmm} setup={setup} columns={columns} />}
      {pmm && <AlarmInputs unit={pmm} setup={setup} />}
      {pmm && <PositionRange unit={pmm} pmc={pmc} setup={setup} />}
      {pmm && <PulseTest unit={pmm} />}
    </section>
  );
}
