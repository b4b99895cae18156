import {
  IconAlertOctagon,
  IconAlertTriangle,
  IconBolt,
  IconCircle,
  IconClockPause,
  IconGhost2,
  IconQuestionMark,
} from "@tabler/icons-react";
import type { AxisData } from "../api/types";
import { useTexts } from "../texts/texts";
import classes from "./SceneDock.module.css";

export type Look = AxisData["look"];

const LOOKS: Look[] = ["enabled", "idle", "warning", "fault", "stale", "unknown"];
const ICONS = {
  unknown: IconQuestionMark,
  stale: IconClockPause,
  idle: IconCircle,
  enabled: IconBolt,
  warning: IconAlertTriangle,
  fault: IconAlertOctagon,
};

/** The sign of a look: its colour in the picture, and a shape of its own. */
export function LookSign({ look }: { look: Look }) {
  const Icon = ICONS[look];
  return (
    <span className={classes.sign} data-look={look} aria-hidden>
      <Icon size={13} stroke={2.4} />
    </span>
  );
}

export function Legend({ ghost }: { ghost: boolean }) {
  const t = useTexts();
  return (
    <ul className={classes.legend} aria-label={t("page.scene.legend")} data-testid="scene-legend">
      {LOOKS.map((look) => (
        <li key={look}>
          <LookSign look={look} />
          {t(`page.look.${look}`)}
        </li>
      ))}
      {ghost && (
        <li>
          <span className={classes.sign} data-look="ghost" aria-hidden>
            <IconGhost2 size={13} stroke={2.4} />
          </span>
          {t("page.look.ghost")}
        </li>
      )}
    </ul>
  );
}
