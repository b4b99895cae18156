import { IconAlertTriangle, IconCircleCheck, IconEqualNot } from "@tabler/icons-react";
import type { ComparisonDoc } from "../../../api/compare";
import { type Translate, useTexts } from "../../../texts/texts";
import classes from "./Compare.module.css";

type Summary = ComparisonDoc["summary"];

const PARTS = ["different", "same", "unit", "missing", "not_comparable"] as const;

/** "7 differ, 120 match, 2 bound to this unit, 0 not found". */
export function sentenceOf(summary: Summary, t: Translate): string {
  // Most comparisons have nothing that cannot be compared: worth a word only where there is.
  return PARTS.filter((part) => part !== "not_comparable" || summary[part] > 0)
    .map((part) =>
      t(`page.compare.sum.${part}${summary[part] === 1 ? "_one" : ""}`, { count: summary[part] }),
    )
    .join(", ");
}

/** The one sentence that sums up, with a sign that is seen first. */
export function Verdict({ summary }: { summary: Summary }) {
  const t = useTexts();
  const gaps = summary.missing + summary.not_comparable + summary.unread + summary.undescribed_different;
  const equal = summary.different === 0;
  const Icon = !equal ? IconEqualNot : gaps > 0 ? IconAlertTriangle : IconCircleCheck;
  const tone = equal && gaps === 0 ? "tone-ok" : "tone-warning";
  return (
    <p className={classes.sentence} role="status" data-testid="verdict">
      <Icon size={24} className={tone} aria-hidden />
      <span>
        {sentenceOf(summary, t)}
        {summary.unread > 0 && (
          <small>
            {" "}
            ·{" "}
            {t(summary.unread === 1 ? "page.compare.sum.unread_one" : "page.compare.sum.unread", {
              count: summary.unread,
            })}
          </small>
        )}
        {summary.undescribed > 0 && (
          <small>
            {" "}
            ·{" "}
            {t(
              summary.undescribed === 1 ? "page.compare.sum.undescribed_one" : "page.compare.sum.undescribed",
              {
                count: summary.undescribed,
                different: summary.undescribed_different,
              },
            )}
          </small>
        )}
      </span>
    </p>
  );
}
