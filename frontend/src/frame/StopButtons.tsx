import { Tooltip } from "@mantine/core";
import { useQueries, useQuery } from "@tanstack/react-query";
import { descriptionQuery, turbineQuery } from "../api/queries";
import { IconHandStop, IconWind } from "@tabler/icons-react";
import { useHearing, useMayMove, useMotionMark, useOfLink } from "../live/live";
import { useTexts } from "../texts/texts";
import classes from "./Frame.module.css";
import { placesOf } from "../ui/devices";
import { entriesOf } from "../ui/reading";
import { usePageSearch } from "./search";
import { Halt, useHalt, useLendStop } from "./stop";

/** Always at the same place. Grey only where nothing is connected; a deaf page still tries. */
export function StopButtons() {
  const t = useTexts();
  const state = useOfLink((link) => link?.state);
  const deaf = useHearing().state === "deaf";
  const commanded = useMotionMark((motion) => motion?.running != null);
  const moving = useMayMove() || commanded;
  const stop = useHalt(Halt.Stop);
  const feather = useHalt(Halt.Feather);
  const turbine = useQuery(turbineQuery).data?.name;
  const [search] = usePageSearch();
  useLendStop(stop.mutate);
  const feathers = useFeathers();
  const nothing = !deaf && state === "disconnected";
  return (
    <div className={classes.stops} role="group" aria-label={t("page.stop.group")}>
      {search.replay !== undefined && (
        <span className={classes.stopsOn} data-testid="stop-on">
          {nothing || turbine === undefined ? (
            t("page.replay.stop_none")
          ) : (
            <>
              {t("page.replay.stop_on")} <b>{turbine}</b>
            </>
          )}
        </span>
      )}
      <Tooltip label={t(feathers ? "page.feather.explain" : "page.feather.none")}>
        <button
          type="button"
          className={classes.feather}
          disabled={nothing || !feathers}
          data-testid="feather"
          onClick={() => feather.mutate()}
        >
          <IconWind size={20} aria-hidden />
          {feathers ? t("page.feather.button") : `${t("page.feather.button")} –`}
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

/** Holds the way to feather of an axis that has one (CiA 402, home to position: 567Ah). */
const FEATHER_OBJECT = "567A";

/** False only where every device that is connected is known to have no feather position. */
function useFeathers(): boolean {
  const devices = placesOf(useQuery(turbineQuery).data).map((place) => place.device);
  const ids = [...new Set(devices.map((device) => device.description_id))];
  const docs = useQueries({ queries: ids.map((id) => descriptionQuery(id)) });
  return ids.length === 0 || docs.some(({ data }) => !data || entriesOf(data).has(FEATHER_OBJECT));
}
