import { useLocation, useNavigate } from "@tanstack/react-router";
import { useCallback } from "react";
import { type PageSearch, readSearch, roomSearch } from "../../frame/search";

const ROOM = "/parameters";

/** Opens an object in the parameters, from there or from another room; dialogs that lead to it close. */
export function useOpenParameter(): (device: string, edit: string) => void {
  const navigate = useNavigate();
  const here = useLocation({ select: (location) => location.pathname === ROOM });
  return useCallback(
    (device: string, edit: string) => {
      const closed = { review: undefined, findings: undefined, q: undefined };
      void navigate({
        to: ROOM,
        search: (before: PageSearch) =>
          here ? readSearch({ ...before, ...closed, device, edit }) : roomSearch(before, { device, edit }),
        replace: here,
      });
    },
    [navigate, here],
  );
}
