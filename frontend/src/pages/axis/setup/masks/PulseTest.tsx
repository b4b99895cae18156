import { IconEye } from "@tabler/icons-react";
import type { DeviceContext } from "../../../../model/shown";
import { useTexts } from "../../../../texts/texts";
import { ReadingText } from "../../../../ui/ReadingText";
import { useReading } from "../../../../ui/reading";
import { bitState } from "../../../overview/layout";
import classes from "./Masks.module.css";

const INPUTS = "30FD";
export const PULSE_WIDTH = "30E2";
/** Inputs that may be tested, and the bits in which a pulse is seen for longer. */
const PAIRS = [
  { input: "efc", feedback: "efc_feedback" },
  { input: "efc_direct", feedback: "efc_direct_feedback" },
  { input: "x13_7", feedback: "x13_7_feedback" },
];

/** The test pulse of three inputs as the PMM sees it. Shown only: nothing here drives an input. */
export function PulseTest({ unit }: { unit: DeviceContext }) {
  const t = useTexts();
  const reading = useReading(unit, INPUTS, "slow");
  return (
    <section className={classes.panel} aria-labelledby="setup-pulse" data-testid="pulse-test">
      <h2 id="setup-pulse">{t("page.setup.masks.pulse.title")}</h2>
      <p className={classes.only}>
        <IconEye size={17} aria-hidden /> {t("page.setup.masks.pulse.only")}
      </p>
      <p className="dim">{t("page.setup.masks.pulse.intro")}</p>
      <p>
        {t("page.setup.masks.pulse.width")} <ReadingText context={unit} address={PULSE_WIDTH} pace="kept" />
      </p>
      <table className={classes.pulses} data-stale={reading?.stale ?? true}>
        <thead>
          <tr>
            <th scope="col">{t("page.setup.masks.pulse.input")}</th>
            <th scope="col">{t("page.setup.masks.pulse.level")}</th>
            <th scope="col">{t("page.setup.masks.pulse.feedback")}</th>
          </tr>
        </thead>
        <tbody>
          {PAIRS.map(({ input, feedback }) => {
            const now = bitState(unit, INPUTS, input);
            const seen = bitState(unit, INPUTS, feedback);
            return (
              <tr key={input}>
                <th scope="row">
                  {now?.bit.clamp}{" "}
                  <small>{now && t("page.setup.masks.pulse.bit", { bit: now.bit.bit })}</small>
                </th>
                <td data-testid={`pulse-${input}`}>{levelOf(now?.set ?? null, t)}</td>
                <td data-testid={`pulse-${feedback}`}>
                  {seen?.set == null ? "–" : seen.set ? "1" : "0"}{" "}
                  <small>{seen && t("page.setup.masks.pulse.bit", { bit: seen.bit.bit })}</small>
                </td>
              </tr>
            );
          })}
        </tbody>
      </table>
      <p className="dim">{t("page.setup.masks.pulse.open")}</p>
    </section>
  );
}

const levelOf = (set: boolean | null, t: (key: string) => string): string =>
  set === null ? "–" : t(set ? "page.setup.masks.on" : "page.setup.masks.off");
