import { IconAlertTriangle, IconCircleX, IconInfoCircle } from "@tabler/icons-react";
import type { PdoFinding } from "../../../api/pdo";
import { useTexts } from "../../../texts/texts";
import { findingText } from "./names";
import classes from "./Pdo.module.css";

const ICONS = { error: IconCircleX, warning: IconAlertTriangle, note: IconInfoCircle };
const TONES = { error: "tone-error", warning: "tone-warning", note: "dim" };

/** What was found at one place, worst first. */
export function Findings({ findings }: { findings: readonly PdoFinding[] }) {
  const t = useTexts();
  if (findings.length === 0) return null;
  return (
    <ul className={classes.findings}>
      {findings.map((finding) => {
        const Icon = ICONS[finding.severity];
        return (
          <li
            key={`${finding.code}-${finding.entry ?? ""}-${JSON.stringify(finding.details)}`}
            className={TONES[finding.severity]}
            data-severity={finding.severity}
            data-testid={`pdo-finding-${finding.code}`}
          >
            <Icon size={16} aria-hidden />
            <span>
              <b>{t(`page.pdo.severity.${finding.severity}`)}: </b>
              {findingText(finding, t)}
            </span>
          </li>
        );
      })}
    </ul>
  );
}
