import { IconLock } from "@tabler/icons-react";
import { useTexts } from "../../texts/texts";
import parameters from "../parameters/Parameters.module.css";
import classes from "./Axis.module.css";

/** Why a part of the axis that acts on a device is not there: what is shown was recorded. */
export function RecordedNote({ part }: { part: "motion" | "battery" | "gear" | "controller" }) {
  const t = useTexts();
  return (
    <section
      className={`${classes.panel} ${classes.wide}`}
      aria-label={t(`page.axis.recorded.${part}`)}
      data-testid="recorded-note"
    >
      <span className={parameters.recorded}>
        <IconLock size={17} aria-hidden /> {t(`page.axis.recorded.${part}_locked`)}
      </span>
    </section>
  );
}
