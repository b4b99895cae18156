import type { CylinderData, CylindersData } from "../api/types";
import { useCylinders } from "../live/live";
import { figure } from "../model/values";
import { type Translate, useTexts } from "../texts/texts";
import { timeOfDay } from "../ui/format";
import classes from "./SceneDock.module.css";
import { LookSign } from "./SceneDockLooks";

const [LENGTH_DIGITS, ANGLE_DIGITS, DEVIATION_DIGITS] = [1, 1, 2];

/** The labels of hydraulic cylinders and of the blade that they turn, in the order in which the 3D view numbers them. */
export function CylinderLabels({ number }: { number: number }) {
  const line = useCylinders()[number - 1];
  if (line === undefined) return null;
  return (
    <>
      <TurnedLabel line={line} number={number} />
      {line.cylinders.map((cylinder) => (
        <CylinderLabel key={cylinder.number} cylinder={cylinder} number={number} />
      ))}
    </>
  );
}

function CylinderLabel({ cylinder, number }: { cylinder: CylinderData; number: number }) {
  const t = useTexts();
  const name = t("page.cylinders.name", { number: cylinder.number });
  return (
    <span
      className={`${classes.label} ${classes.told}`}
      data-look={cylinder.look}
      data-place={`cylinder-${number}-${cylinder.number}`}
      data-blade={cylinder.number}
      data-testid={`scene-cylinder-${number}-${cylinder.number}`}
    >
      <LookSign look={cylinder.look} />
      <b>{name}</b>
      <span className={classes.angle}>{length(t, cylinder.position, cylinder.unit, LENGTH_DIGITS)}</span>
      <span className={classes.state}>{stateOf(t, cylinder)}</span>
      {cylinder.setpoint !== null && (
        <span className={classes.state}>
          {t("page.cylinders.setpoint", {
            setpoint: length(t, cylinder.setpoint, cylinder.unit, LENGTH_DIGITS),
          })}
        </span>
      )}
      {cylinder.limits !== null && (
        <span className={classes.state}>
          {t("page.cylinders.limits", {
            low: length(t, cylinder.limits[0], "", LENGTH_DIGITS),
            high: length(t, cylinder.limits[1], cylinder.unit, LENGTH_DIGITS),
          })}
        </span>
      )}
    </span>
  );
}

/** How far the blade as drawn is turned, and how far its cylinders are apart. */
function TurnedLabel({ line, number }: { line: CylindersData; number: number }) {
  const t = useTexts();
  const angle = line.angle_deg === null ? "–" : `${figure(line.angle_deg, ANGLE_DIGITS, t.language)}°`;
  return (
    <span
      className={classes.label}
      data-look={line.look}
      data-place={`turned-${number}`}
      data-blade={0}
      data-testid={`scene-turned-${number}`}
    >
      <LookSign look={line.look} />
      <b title={t("page.cylinders.angle_explain")}>{t("page.cylinders.turned", { angle })}</b>
      {line.cylinders.length > 1 && (
        <>
          <span className={classes.state}>{t(`page.cylinders.${together(line.synchronous)}`)}</span>
          <span className={classes.state}>
            {t("page.cylinders.deviation", {
              deviation: length(t, line.deviation, line.unit, DEVIATION_DIGITS),
            })}
          </span>
        </>
      )}
    </span>
  );
}

const together = (synchronous: boolean | null) =>
  synchronous === null ? "together_unknown" : synchronous ? "synchronous" : "single";

/** What it complains of comes first; then what is not the present; then the state of the axis. */
function stateOf(
  t: Translate,
  { look, state, fault_code, fault_text_key, position_t_ns }: CylinderData,
): string {
  if (fault_code) {
    const code = `${fault_code.toString(16).toUpperCase().padStart(4, "0")}h`;
    return fault_text_key === null ? code : `${code} ${t(fault_text_key)}`;
  }
  if (look === "stale" && position_t_ns !== null)
    return t("page.look.stale_since", { time: timeOfDay(position_t_ns / 1e6, 0) });
  if (look === "unknown") return t("page.cylinders.untold");
  return state === null ? t(`page.look.${look}`) : t(state);
}

function length(t: Translate, number: number | null, unit: string, digits: number): string {
  if (number === null) return "–";
  const gap = unit === "" || unit === "°" ? "" : "\u00a0";
  return `${figure(number, digits, t.language)}${gap}${unit}`;
}
