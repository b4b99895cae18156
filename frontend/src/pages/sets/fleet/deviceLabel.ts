import { useCallback } from "react";
import { turbineOf, usePlaceName } from "../compare/titles";

/** "WTG-07 Blade 2 PMC". */
export function useFleetDevice(): (slug: string) => string {
  const nameOf = usePlaceName();
  return useCallback((slug) => `${turbineOf(slug)} ${nameOf(slug)}`, [nameOf]);
}
