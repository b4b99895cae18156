/** Into a replay and out of it: where one came from is where one gets back to. */
import { useNavigate, useRouter } from "@tanstack/react-router";
import { useCallback } from "react";
import { digitsOf } from "../api/trace";
import { type PageSearch, readSearch, roomSearch } from "../frame/search";

const CAME_FROM = "hubside.replay.came_from";

/** Opens the replay of a recording, at a moment where one is given; the way back is a step of the browser's history. */
export function useOpenReplay(): (file: string, atNs?: number) => void {
  const navigate = useNavigate();
  const router = useRouter();
  return useCallback(
    (file, atNs) => {
      sessionStorage.setItem(CAME_FROM, router.state.location.href);
      void navigate({
        to: "/recordings",
        search: (before: PageSearch) =>
          readSearch({ ...roomSearch(before), replay: replayOfFile(file), at: momentOf(atNs) }),
      });
    },
    [navigate, router],
  );
}

/** Opens the replay that such a search names, with all that is to be seen of it. */
export function useOpenReplayAt(): (own: PageSearch) => void {
  const navigate = useNavigate();
  const router = useRouter();
  return useCallback(
    (own) => {
      sessionStorage.setItem(CAME_FROM, router.state.location.href);
      void navigate({ to: "/recordings", search: (before: PageSearch) => roomSearch(before, own) });
    },
    [navigate, router],
  );
}

/** Leaves the replay, to where it was opened; who came by a link gets to the same room of the bench. */
export function useLeaveReplay(): () => void {
  const navigate = useNavigate();
  const router = useRouter();
  return useCallback(() => {
    const from = sessionStorage.getItem(CAME_FROM);
    sessionStorage.removeItem(CAME_FROM);
    if (from !== null) router.history.push(from);
    else
      void navigate({
        to: ".",
        search: (before: PageSearch) =>
          readSearch({ ...roomSearch(before), replay: undefined, at: undefined }),
      });
  }, [navigate, router]);
}

const momentOf = (tNs: number | undefined): string | undefined =>
  tNs === undefined ? undefined : digitsOf(tNs);

export const replayOfFile = (file: string): string => file.replace(/\.mcap$/, "");
