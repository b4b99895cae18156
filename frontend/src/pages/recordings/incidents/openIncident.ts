import { useCallback } from "react";
import type { Incident } from "../../../api/incidents";
import { parseSearch, readSearch } from "../../../frame/search";
import { useOpenReplayAt } from "../../../replay/leaving";

/** Goes to the replay of an incident as its short link does: moment, plots, camera, loop. */
export function useOpenIncident(): (incident: Incident) => void {
  const open = useOpenReplayAt();
  return useCallback(
    ({ page }) => open(readSearch(parseSearch(new URL(page, location.href).search))),
    [open],
  );
}
