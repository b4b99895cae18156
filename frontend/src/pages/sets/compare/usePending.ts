/** The changes that are not written yet, of the devices whose editor stands in a column. */
import { useMemo } from "react";
import type { Pending } from "../../../api/compare";
import { useStaged } from "../../parameters/staging";
import { parseSpec, Source } from "./specs";

export function usePendingOf(columns: readonly string[]): Pending {
  const { changes } = useStaged();
  return useMemo(() => {
    const pending: Pending = {};
    for (const column of columns) {
      const spec = parseSpec(column);
      if (spec?.source === Source.Editor) pending[spec.of] = {};
    }
    for (const { device, address, raw } of changes.values()) {
      const of = pending[device];
      if (of) of[address] = raw;
    }
    return pending;
  }, [columns, changes]);
}
