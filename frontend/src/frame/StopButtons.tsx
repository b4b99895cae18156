import { Tooltip } from "@mantine/core";
import { IconHandStop, IconWind } from "@tabler/icons-react";
import { useAxes, useHearing, useLink } from "../live/live";
import { useTexts } from "../texts/texts";
import classes from "./Frame.module.css";
import { mayMove } from "../live/axis";
import { Halt, useHalt, useLendStop } from "./stop";

/** Always at the same place. Grey only where nothing is connected; a deaf page still tries. */
export function StopButtons() {
  const t = useTexts();
  const link = useLink();
  const deaf = useHearing().state === "deaf";
  const moving = mayMove(useAxes().values());
  const stop = useHalt(Halt.Stop);
  const feather = useHalt(Halt.Feather);
  useLendStop(stop.mutate);
  const nothing = !deaf && link?.state === "disconnected";
  return (
    <div className={classes.stops} role="group" aria-label={t("page.stop.group")}>
      <Tooltip label={t("page.feather.explain")}>
        <button
          type="button"
          className={classes.feather}
          disabled={nothing}
          data-testid="feather"
          onClick={() => feather.mutate()}
        >
          <IconWind size={20} aria-hidden />
          {t("page.feather.button")}
        </button>
      </Tooltip>
      <Tooltip label={t("page.stop.explain")}>
        <button
          type="button"
          className={classes.stop}
          disabled={nothing}
          data-testid="stop"
          aria-keyshortcuts={moving ? "Escape" : undefined}
          onClick={() => stop.mutate()}
        >
          <IconHandStop size={20} aria-hidden />
          {t("page.stop.button")}
          {moving && !nothing && <kbd aria-hidden>Esc</kbd>}
        </button>
      </Tooltip>
    </div>
  );
}
