/** Where times lie in the plots: all have the same area, so that one line marks one moment in all of them. */
import type { Stretch } from "../../../replay/looking";

export const LEFT_PX = 54;
const RIGHT_PX = 10;
const AXIS_PX = 48;

/** Room of one plot in px; `axes` is how many the plot with the most has. */
export interface Room {
  width: number;
  axes: number;
}

export const rightPx = (axes: number): number => RIGHT_PX + Math.max(0, axes - 1) * AXIS_PX;
export const areaPx = ({ width, axes }: Room): number => Math.max(1, width - LEFT_PX - rightPx(axes));

export const secondsOf = (tNs: number, whole: Stretch): number => (tNs - whole.fromNs) / 1e9;

/** Left end and width of a stretch within the area, in px; null where it is not in view. */
export function extent(
  stretch: Stretch,
  view: Stretch,
  area: number,
): { left: number; width: number } | null {
  const at = (tNs: number) => ((tNs - view.fromNs) / (view.toNs - view.fromNs)) * area;
  const [left, right] = [Math.max(0, at(stretch.fromNs)), Math.min(area, at(stretch.toNs))];
  return right < 0 || left > area || right < left ? null : { left, width: right - left };
}
