import { IconAlertTriangle, IconCircleCheck, IconEqualNot } from "@tabler/icons-react";
import type { ComparisonDoc } from "../../../api/compare";
import { type Translate, useTexts } from "../../../texts/texts";
import classes from "./Compare.module.css";

type Summary = ComparisonDoc["summary"];

const PARTS = ["different", "same", "unit", "missing", "not_comparable", "unread"] as const;
/** What is worth a word only where there is any. */
const SILENT: readonly (typeof PARTS)[number][] = ["not_comparable", "unread"];

/** "7 differ, 120 match, 2 bound to this unit, 0 not found". */
export function sentenceOf(summary: Summary, t: Translate): string {
  return PARTS.filter((part) => !SILENT.includes(part) || summary[part] > 0)
    .map((part) =>
      t(`page.compare.sum.${part}${summary[part] === 1 ? "_one" : ""}`, { count: summary[part] }),
    )
    .join(", ");
}

/** The one sentence that sums up, with a sign that is seen first. */
export function Verdict({ summary }: { summary: Summary }) {
  const t = useTexts();
  const gaps = summary.missing + summary.not_comparable + summary.unread;
  const equal = summary.different === 0;
  const Icon = !equal ? IconEqualNot : gaps > 0 ? IconAlertTriangle : IconCircleCheck;
  const tone = equal && gaps === 0 ? "tone-ok" : "tone-warning";
  return (
    <p className={classes.sentence} role="status" data-testid="verdict">
      <Icon size={24} className={tone} aria-hidden />
      <span>{sentenceOf(summary, t)}</span>
    </p>
  );
}
