/** Times on the common axis in words, and the way back to the moment of one recording. */
import { useCallback } from "react";
import type { Aligned } from "../../../api/overlay";
import { useOpenReplay } from "../../../replay/leaving";

const SECOND_MS = 1000;

/** `−500 ms`, `0`, `2 s`: from the zero on. */
export const msText =
  (show: (text: string) => string) =>
  (ms: number): string => {
    if (ms === 0) return "0";
    const whole = Math.abs(ms) >= SECOND_MS;
    const number = Number((whole ? ms / SECOND_MS : ms).toFixed(3));
    return `${show(String(number).replace("-", "−"))} ${whole ? "s" : "ms"}`;
  };

/** Opens a recording of the overlay, so long after its zero. */
export function useOpenAt(): (recording: Aligned, ms: number) => void {
  const replay = useOpenReplay();
  return useCallback(
    ({ name, t0_ns }, ms) => {
      if (t0_ns !== null) replay(name, Math.round(t0_ns + ms * 1e6));
    },
    [replay],
  );
}
