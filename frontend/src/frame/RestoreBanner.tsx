import { Button } from "@mantine/core";
import { IconAlertOctagon, IconClockHour4, IconLoader2 } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useNavigate } from "@tanstack/react-router";
import { lazy, Suspense } from "react";
import { turbineQuery } from "../api/queries";
import { openRestoresQuery, type RestoreHead } from "../api/restore";
import { useHearing } from "../live/live";
import { useTexts } from "../texts/texts";
import { stationName } from "../ui/devices";
import { lastOf } from "../ui/format";
import { type PageSearch, roomSearch, usePageSearch } from "./search";
import classes from "./RestoreBanner.module.css";

/** Comes with the sets room, which is not part of the first load. */
const WaysOut = lazy(async () => ({ default: (await import("../pages/sets/restore/Decision")).WaysOut }));

const LOOKS = {
  incomplete: { Icon: IconAlertOctagon, tone: "error" },
  "awaiting-confirmation": { Icon: IconClockHour4, tone: "warning" },
} as const;
const RUNNING = { Icon: IconLoader2, tone: "warning" };

/** On every page: a restore that was cut off and blocks its blade, or one that runs and may wait for a person. */
export function RestoreBanner() {
  const hearing = useHearing().state === "hearing";
  const [search] = usePageSearch();
  const open = useQuery({ ...openRestoresQuery, enabled: hearing }).data ?? [];
  if (!hearing) return null;
  // The page of the restore itself says it all, and better.
  return open.filter((one) => one.id !== search.restore).map((one) => <Line key={one.id} restore={one} />);
}

function Line({ restore }: { restore: RestoreHead }) {
  const t = useTexts();
  const navigate = useNavigate();
  const turbine = useQuery(turbineQuery).data;
  const found = turbine?.stations.find((one) => one.slug === restore.station);
  const station = found ? stationName(found, t) : lastOf(restore.station);
  const here = turbine?.slug === restore.turbine;
  const { state } = restore;
  const look = state === "incomplete" || state === "awaiting-confirmation" ? LOOKS[state] : RUNNING;
  const kind = state === "incomplete" && !here ? "elsewhere" : look === RUNNING ? "running" : state;
  const names = { station, turbine: restore.turbine.toUpperCase() };
  const goThere = () =>
    void navigate({
      to: "/sets",
      search: (before: PageSearch) => roomSearch(before, { tab: "restore", restore: restore.id }),
    });
  return (
    <div
      className={classes.banner}
      data-tone={look.tone}
      role="alert"
      data-testid={`restore-banner-${state}`}
    >
      <look.Icon size={22} aria-hidden />
      <div>
        <strong>{t(`page.restoring.banner.${kind}`, names)}</strong>
        <span>{t(`page.restoring.banner_means.${kind}`, names)}</span>
      </div>
      <Button variant="default" onClick={goThere} data-testid="restore-banner-open">
        {t("page.restoring.banner_open")}
      </Button>
      {state === "incomplete" && here && (
        <Suspense>
          <WaysOut doc={restore} />
        </Suspense>
      )}
    </div>
  );
}
