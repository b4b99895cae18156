import { useCallback } from "react";
import { useNavigate } from "@tanstack/react-router";
import type { FleetDevice, FleetDoc } from "../../../api/fleet";
import { type PageSearch, roomSearch } from "../../../frame/search";
import { compareSearch, specText, Source } from "../compare/specs";

/** Opens the comparison of a device's set with the golden one, of one group where it is named. */
export function useOpenComparison(doc: FleetDoc): (device: FleetDevice, group?: string) => void {
  const navigate = useNavigate();
  const golden =
    doc.golden.record === null ? doc.golden.spec : specText({ source: Source.Set, of: doc.golden.record });
  return useCallback(
    (device, group) =>
      void navigate({
        to: "/sets",
        search: (before: PageSearch) =>
          roomSearch(before, {
            ...compareSearch([golden, specText({ source: Source.Set, of: device.record })]),
            ...(group !== undefined && { group }),
          }),
      }),
    [navigate, golden],
  );
}
