import { useTexts } from "../../../../texts/texts";
import classes from "../common/Setup.module.css";
import type { Line } from "../common/Track";

const KEYS = ["3063", "6079", "mains", "battery"];

/** The lines across the ladder with their values; one that is old says so. */
export function Voltages({ lines }: { lines: readonly (Line | null)[] }) {
  const t = useTexts();
  return (
    <ul className={classes.legend}>
      {KEYS.map((key) => {
        const line = lines.find((one) => one?.key === key);
        return (
          <li key={key} data-stale={line?.stale ?? true} data-testid={`voltage-${key}`}>
            <i className={classes.sample} data-kind={line?.kind ?? "reference"} data-key={key} aria-hidden />
            {line ? line.title : `${t(`page.setup.ladder.line.${key}`)}: –`}
            {line?.stale && <em> {t("page.setup.common.stale")}</em>}
          </li>
        );
      })}
    </ul>
  );
}
