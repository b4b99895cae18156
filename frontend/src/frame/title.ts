/** What the tab of the browser says: the room and the turbine, so that several tabs are told apart. */
import { useQuery } from "@tanstack/react-query";
import { useRouterState } from "@tanstack/react-router";
import { useEffect } from "react";
import { turbineQuery } from "../api/queries";
import type { Replay } from "../replay/opening";
import { type Translate, useTexts } from "../texts/texts";
import { ROOMS } from "./rooms";

/** `turbine` is undefined while none is connected. */
export function titleOf(path: string, turbine: string | undefined, t: Translate): string {
  const room = ROOMS.find((one) => one.path === path);
  if (!room) return t("page.title.plain");
  const words = { room: t(`page.rooms.${room.name}`), turbine: turbine ?? null };
  return t(turbine === undefined ? "page.title.room" : "page.title.turbine", words);
}

/** Of a replay the turbine that was recorded, and that it was. */
export function usePageTitle(replay: Replay | null): void {
  const t = useTexts();
  const path = useRouterState({ select: (state) => state.location.pathname });
  const connected = useQuery(turbineQuery).data?.name;
  const turbine = replay ? t("page.title.recorded", { turbine: replay.doc?.name ?? replay.id }) : connected;
  const title = titleOf(path, turbine, t);
  useEffect(() => {
    document.title = title;
  }, [title]);
}
