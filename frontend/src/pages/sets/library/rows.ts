/** The values of a set beside those of the device now. */
import type { Raw } from "../../../api/types";

export interface SetRow {
  address: string;
  raw: Raw;
  /** null: not known. */
  now: Raw | null;
  /** True where both are known and are not the same; what is not known differs from nothing. */
  different: boolean;
}

/** Rows in the order of their addresses. */
export function setRows(
  values: Readonly<Record<string, Raw>>,
  nowOf: (address: string) => Raw | null,
): SetRow[] {
  return Object.entries(values)
    .map(([address, raw]) => {
      const now = nowOf(address);
      return { address, raw, now, different: now !== null && now !== raw };
    })
    .toSorted((a, b) => a.address.localeCompare(b.address));
}
