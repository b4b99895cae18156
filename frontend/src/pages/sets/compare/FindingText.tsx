import { IconAlertTriangle } from "@tabler/icons-react";
import { useTexts } from "../../../texts/texts";
import classes from "./Compare.module.css";

/** The rule that the values of a column break. */
export function FindingText({ rule }: { rule: string }) {
  const t = useTexts();
  return (
    <div role="gridcell" className={`${classes.finding} tone-warning`}>
      <IconAlertTriangle size={16} aria-hidden />
      <strong>{t(`rule.${rule}.title`)}</strong>
      <span className="dim">{t(`rule.${rule}.why`)}</span>
    </div>
  );
}
