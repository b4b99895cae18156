import type { Motor } from "../../../api/motors";
import { useTexts } from "../../../texts/texts";
import classes from "./Motors.module.css";

/** No such motor exists: said wherever an example is shown. */
export function InventedChip({ motor }: { motor: Motor }) {
  const t = useTexts();
  if (!motor.invented) return null;
  return (
    <span className={classes.chip} data-testid="invented">
      {t("motor.source.example")}
    </span>
  );
}
