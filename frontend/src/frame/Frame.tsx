import { Outlet, useRouterState } from "@tanstack/react-router";
import { lazy, Suspense } from "react";
import { live, ShownContext, useChannel, useHearing, useLiveMode } from "../live/live";
import { useKeepLease } from "../motion/lease";
import { ReplayContext, useOpening } from "../replay/opening";
import { Notices } from "../ui/Notices";
import { ConsentBanner } from "./ConsentBanner";
import { DeafBanner } from "./DeafBanner";
import { EventDrawer } from "./EventDrawer";
import classes from "./Frame.module.css";
import { Navigation } from "./Navigation";
import { RestoreBanner } from "./RestoreBanner";
import { LIVE_ROOMS } from "./rooms";
import { SceneDock } from "./SceneDock";
import { usePageSearch } from "./search";
import { TopBar } from "./TopBar";
import { useEscapeStops } from "./stop";
import { usePageTitle } from "./title";

/** Only who replays loads what moves a recording. */
const ReplayBar = lazy(async () => ({ default: (await import("../replay/ReplayBar")).ReplayBar }));
const RecordedRoom = lazy(async () => ({ default: (await import("../replay/ReplayRoom")).RecordedRoom }));
const LiveRoomNote = lazy(async () => ({ default: (await import("../replay/ReplayRoom")).LiveRoomNote }));

/**
 * The frame of every page: who we are connected to above, rooms left, 3D right, events below. The top bar is always about
 * the bench; all else shows the recording where one is replayed.
 */
export function Frame() {
  const deaf = useHearing().state !== "hearing";
  const mode = useLiveMode();
  const path = useRouterState({ select: (state) => state.location.pathname });
  const [search] = usePageSearch();
  const channel = useChannel(search.replay);
  const replay = useOpening(channel, search.replay);
  useEscapeStops();
  useKeepLease();
  usePageTitle(replay);
  return (
    <div
      className={classes.frame}
      data-deaf={deaf}
      data-mode={mode}
      data-page={path}
      data-replay={replay !== null}
    >
      <TopBar />
      <div className={classes.banners}>
        <DeafBanner />
        <ConsentBanner />
        <RestoreBanner />
      </div>
      <ReplayContext value={replay}>
        <ShownContext key={channel.ctx} value={channel}>
          {replay && (
            <div className={classes.replay}>
              <Suspense>
                <ReplayBar />
              </Suspense>
            </div>
          )}
          <Navigation />
          <main className={classes.main}>
            <Suspense>
              <Room path={path} recorded={replay !== null} />
            </Suspense>
          </main>
          {(replay === null || replay.doc) && (
            <>
              <SceneDock />
              <EventDrawer />
            </>
          )}
        </ShownContext>
      </ReplayContext>
      <Notices />
    </div>
  );
}

/** The room of the URL, with what it is about: the recording, the bench, or the bench although a recording is shown. */
function Room({ path, recorded }: { path: string; recorded: boolean }) {
  if (!recorded) return <Outlet />;
  if (!LIVE_ROOMS.includes(path))
    return (
      <RecordedRoom>
        <Outlet />
      </RecordedRoom>
    );
  return (
    <ShownContext value={live}>
      <div className={classes.liveRoom}>
        <LiveRoomNote />
        <div>
          <Outlet />
        </div>
      </div>
    </ShownContext>
  );
}
