import { IconLock } from "@tabler/icons-react";
import { useTexts } from "../../texts/texts";
import classes from "./Parameters.module.css";

/** Why nothing can be read, changed or saved here: what is shown was recorded. */
export function ReplayLock() {
  const t = useTexts();
  return (
    <span className={classes.recorded} data-testid="replay-lock">
      <IconLock size={17} aria-hidden /> {t("page.replay.parameters")}
    </span>
  );
}
