import { IconAlertTriangle } from "@tabler/icons-react";
import type { Skipped } from "../../../api/search";
import { useTexts } from "../../../texts/texts";
import classes from "./Search.module.css";

/** The recordings that were not looked into, and why: what is missing is said. */
export function SkippedList({ skipped }: { skipped: readonly Skipped[] }) {
  const t = useTexts();
  if (skipped.length === 0) return null;
  return (
    <details className={classes.skipped} data-testid="search-skipped">
      <summary>
        <IconAlertTriangle size={16} aria-hidden /> {t("page.search.skipped", { count: skipped.length })}
      </summary>
      <ul>
        {skipped.map((one) => (
          <li key={one.name}>
            <strong>{one.name}</strong> {t(one.reason_key)}
            {one.text_key !== null && `: ${t(one.text_key, one.details)}`}
          </li>
        ))}
      </ul>
    </details>
  );
}
