import { Outlet, useRouterState } from "@tanstack/react-router";
import { Suspense } from "react";
import { useHearing, useLink } from "../live/live";
import { Notices } from "../ui/Notices";
import { ConsentBanner } from "./ConsentBanner";
import { DeafBanner } from "./DeafBanner";
import { EventDrawer } from "./EventDrawer";
import classes from "./Frame.module.css";
import { Navigation } from "./Navigation";
import { RestoreBanner } from "./RestoreBanner";
import { SceneDock } from "./SceneDock";
import { TopBar } from "./TopBar";
import { useEscapeStops } from "./stop";
import { usePageTitle } from "./title";

/** The frame of every page: who we are connected to above, rooms left, 3D right, events below. */
export function Frame() {
  const deaf = useHearing().state !== "hearing";
  const link = useLink();
  const mode = link?.state === "connected" ? link.mode : "none";
  const path = useRouterState({ select: (state) => state.location.pathname });
  useEscapeStops();
  usePageTitle();
  return (
    <div className={classes.frame} data-deaf={deaf} data-mode={mode} data-page={path}>
      <TopBar />
      <div className={classes.banners}>
        <DeafBanner />
        <ConsentBanner />
        <RestoreBanner />
      </div>
      <Navigation />
      <main className={classes.main}>
        <Suspense>
          <Outlet />
        </Suspense>
      </main>
      <SceneDock />
      <EventDrawer />
      <Notices />
    </div>
  );
}
