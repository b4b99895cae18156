import { IconAlertOctagon, IconAlertTriangle, IconFlame, IconSnowflake, IconWind } from "@tabler/icons-react";
import { useTexts } from "../../../../texts/texts";
import classes from "../common/Setup.module.css";

const LOOKS: Readonly<Record<string, { Icon: typeof IconFlame; tone: string }>> = {
  lower_limit: { Icon: IconSnowflake, tone: "warning" },
  warning_limit: { Icon: IconAlertTriangle, tone: "warning" },
  error_limit: { Icon: IconAlertOctagon, tone: "error" },
  sensor_short_circuit: { Icon: IconAlertTriangle, tone: "warning" },
  sensor_interrupt: { Icon: IconAlertTriangle, tone: "warning" },
  heater_on: { Icon: IconFlame, tone: "on" },
  cooler_on: { Icon: IconSnowflake, tone: "on" },
  fan_on: { Icon: IconWind, tone: "on" },
};

/** What is lit now, each with icon and word. */
export function Lit({ states }: { states: readonly string[] }) {
  const t = useTexts();
  return (
    <span className={classes.lit}>
      {states.map((state) => {
        const look = LOOKS[state];
        return (
          look && (
            <span key={state} data-tone={look.tone} data-testid={`lit-${state}`}>
              <look.Icon size={14} aria-hidden /> {t(`page.setup.temperatures.lit.${state}`)}
            </span>
          )
        );
      })}
    </span>
  );
}
