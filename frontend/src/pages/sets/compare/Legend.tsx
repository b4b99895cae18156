import type { RowState } from "../../../api/compare";
import { useTexts } from "../../../texts/texts";
import classes from "./Compare.module.css";
import { ROW_SIGNS } from "./signs";

const STATES: readonly RowState[] = ["different", "same", "unit", "missing", "not-comparable"];

/** What the signs of the rows mean, and the keys. */
export function Legend({ pickable }: { pickable: boolean }) {
  const t = useTexts();
  return (
    <ul className={classes.legend} aria-label={t("page.compare.legend")}>
      {STATES.map((state) => {
        const Icon = ROW_SIGNS[state];
        return (
          <li key={state}>
            <Icon size={15} aria-hidden /> {t(`page.compare.row.${state}`)}
          </li>
        );
      })}
      <li>{t(pickable ? "page.compare.keys_pick" : "page.compare.keys")}</li>
    </ul>
  );
}
