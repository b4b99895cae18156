import { useTexts } from "../../texts/texts";
import classes from "./Parameters.module.css";

const STATES = ["plain", "saved", "proven", "unsaved", "stale", "unknown", "pending", "refused"] as const;

/** What the marks of a value mean, and how many rows are shown. */
export function Legend({ shown, total }: { shown: number; total: number }) {
  const t = useTexts();
  return (
    <div className={classes.legend}>
      <strong role="status" data-testid="count">
        {t("page.table.count", { shown, total })}
      </strong>
      <ul aria-label={t("page.legend.label")}>
        {STATES.map((state) => (
          <li key={state} data-state={state}>
            {t(`page.legend.${state}`)}
          </li>
        ))}
      </ul>
    </div>
  );
}
