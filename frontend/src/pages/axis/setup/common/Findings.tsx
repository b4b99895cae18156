import { IconAlertTriangle, IconCircleX, IconInfoCircle } from "@tabler/icons-react";
import type { RuleFinding } from "../../../../api/rules";
import { findingKey, lineOfFinding, reasonOfFinding } from "../../../../model/ruleFindings";
import { useTexts } from "../../../../texts/texts";
import type { Parameter } from "./parameter";
import classes from "./Setup.module.css";

const ICONS = { error: IconCircleX, warning: IconAlertTriangle, note: IconInfoCircle };

/** Each broken rule of these objects once. */
export function findingsOf(parameters: readonly (Parameter | null)[]): RuleFinding[] {
  const found = new Map<string, RuleFinding>();
  for (const parameter of parameters)
    for (const finding of parameter?.findings ?? []) found.set(findingKey(finding), finding);
  return [...found.values()];
}

/** What the rules say of these objects, with all that is pending: icon, words, and why on hover. */
export function Findings({ findings }: { findings: readonly RuleFinding[] }) {
  const t = useTexts();
  if (findings.length === 0) return null;
  return (
    <ul className={classes.findings}>
      {findings.map((finding) => {
        const Icon = ICONS[finding.severity];
        return (
          <li
            key={findingKey(finding)}
            data-severity={finding.severity}
            title={reasonOfFinding(finding, t)}
            data-testid={`setup-rule-${finding.rule}`}
          >
            <Icon size={15} role="img" aria-label={t(`rule.severity.${finding.severity}`)} />{" "}
            {lineOfFinding(finding, t)}
          </li>
        );
      })}
    </ul>
  );
}
