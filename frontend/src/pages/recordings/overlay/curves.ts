/** The curves of all recordings as they are drawn: one plot for each object, a colour for each recording, a dash for each blade. */
import type { Aligned, AlignedTrack } from "../../../api/overlay";
import { type Track, trackOf } from "../../../model/tracks";

export interface Curve {
  /** Recording, node and object: names it in tests and lists. */
  id: string;
  recording: Aligned;
  line: AlignedTrack;
  track: Track;
  colour: number;
  dash: readonly number[];
  held: boolean;
}

export interface OverlayPlot {
  address: string;
  title: string;
  unit: string;
  curves: Curve[];
}

export const COLOURS = 8;
const DASHES: readonly (readonly number[])[] = [[], [7, 4], [2, 3], [9, 3, 2, 3]];
/** Values that come less often than this hold until the next one. */
const SLOW_MS = 250;

export function plotsOf(recordings: readonly Aligned[]): OverlayPlot[] {
  const plots = new Map<string, OverlayPlot>();
  recordings.forEach((recording, at) => {
    for (const line of recording.tracks) {
      const plot = plots.get(line.address) ?? {
        address: line.address,
        title: line.name,
        unit: line.unit,
        curves: [],
      };
      plots.set(line.address, plot);
      plot.curves.push({
        id: `${recording.name}-${line.device ?? `${line.bus}/${line.node}`}-${line.address}`,
        recording,
        line,
        track: drawn(line),
        colour: at % COLOURS,
        dash: dashOf(line),
        held: isHeld(line),
      });
    }
  });
  return [...plots.values()];
}

const dashOf = ({ blade }: AlignedTrack): readonly number[] =>
  DASHES[((blade ?? 1) - 1) % DASHES.length] ?? [];

function isHeld({ exact, unit, t_ms }: AlignedTrack): boolean {
  if (unit === "") return true;
  const reach = (t_ms.at(-1) ?? 0) - (t_ms[0] ?? 0);
  return exact && (t_ms.length < 2 || reach / (t_ms.length - 1) > SLOW_MS);
}

/** Times in ms; no line crosses a break. */
export function drawn({ exact, step_ms, t_ms, low, high, breaks_ms }: AlignedTrack): Track {
  const points: [number, number | null, number | null][] = t_ms.map((at, n) => [
    at,
    low[n] ?? null,
    high[n] ?? null,
  ]);
  const breaks: typeof points = breaks_ms.map((at) => [at, null, null]);
  // A break comes before a value of the same time: that one was told after it.
  const all = [...breaks, ...points].sort((a, b) => a[0] - b[0]);
  return trackOf({
    exact,
    bucket_s: step_ms,
    t_s: all.map(([at]) => at),
    low: all.map(([, least]) => least),
    high: all.map(([, , greatest]) => greatest),
  });
}
