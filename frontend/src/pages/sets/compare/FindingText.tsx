import { IconAlertOctagon, IconAlertTriangle, IconInfoCircle } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { type RuleSeverity, rulesQuery } from "../../../api/rules";
import { useTexts } from "../../../texts/texts";
import classes from "./Compare.module.css";
import type { ColumnContext } from "./compared";
import type { FindingLine } from "./lines";
import { Against } from "./marks";
import { standingOf } from "./standing";
import { useColumnTitle } from "./titles";

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

interface Props {
  line: FindingLine;
  columns: readonly ColumnContext[];
  against: Against;
}

/** A rule that the values of a column break: in which columns, what that means, and why it is a rule. */
export function FindingText({ line, columns, against }: Props) {
  const { rule, broken } = line;
  const t = useTexts();
  const titleOf = useColumnTitle();
  const severity = useSeverity([rule]);
  const standing = standingOf(broken, columns.length, against);
  const nameOf = (at: number) => {
    const column = columns[at]?.column;
    if (!column) return "";
    const { place, source } = titleOf(column, false);
    return against === Against.Majority ? place : `${place} ${source}`;
  };
  const why = t(`rule.${rule}.why`);
  return (
    <div role="gridcell" className={classes.finding}>
      <SeveritySign severity={severity} />
      <strong>
        {t(`rule.severity.${severity}`)}: {t(`rule.${rule}.title`)}
      </strong>
      <span className={classes.standing} data-standing={standing} data-testid={`standing-${line.id}`}>
        {t(`page.compare.standing.${standing}`, { columns: broken.map(nameOf).join(", ") })}
      </span>
      <span className={`${classes.why} dim`} title={why}>
        {why}
      </span>
    </div>
  );
}
