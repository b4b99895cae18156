import { IconAlertOctagon, IconAlertTriangle, IconInfoCircle } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { type RuleSeverity, rulesQuery } from "../../../api/rules";
import { useTexts } from "../../../texts/texts";
import classes from "./Compare.module.css";

const LOOKS = {
  error: { Icon: IconAlertOctagon, tone: "tone-error" },
  warning: { Icon: IconAlertTriangle, tone: "tone-warning" },
  note: { Icon: IconInfoCircle, tone: "dim" },
} satisfies Record<RuleSeverity, unknown>;
const BY_WEIGHT = ["error", "warning", "note"] as const;

/** How grave the gravest of these rules is. */
export function useSeverity(ids: readonly string[]): RuleSeverity {
  const rules = useQuery(rulesQuery).data;
  const found = new Set(rules?.filter((rule) => ids.includes(rule.id)).map((rule) => rule.severity));
  return BY_WEIGHT.find((severity) => found.has(severity)) ?? "warning";
}

export function SeveritySign({ severity }: { severity: RuleSeverity }) {
  const { Icon, tone } = LOOKS[severity];
  return <Icon size={16} className={tone} aria-hidden />;
}

/** A rule that the values of a column break, and why it is one. */
export function FindingText({ rule }: { rule: string }) {
  const t = useTexts();
  const severity = useSeverity([rule]);
  return (
    <div role="gridcell" className={classes.finding}>
      <SeveritySign severity={severity} />
      <strong>
        {t(`rule.severity.${severity}`)}: {t(`rule.${rule}.title`)}
      </strong>
      <span className="dim">{t(`rule.${rule}.why`)}</span>
    </div>
  );
}
