/** A straight scale that pictures are drawn on: where a value stands, and which value stands at a place. */

export interface Scale {
  low: number;
  high: number;
}

/** Where a value stands, 0 at the lower end and 1 at the upper one; outside of the scale at its end. */
export function shareOf(scale: Scale, value: number): number {
  return Math.min(1, Math.max(0, (value - scale.low) / (scale.high - scale.low)));
}

/** The value at a place, on a whole multiple of `snap`. */
export function valueAt(scale: Scale, share: number, snap: number): number {
  const inside = Math.min(1, Math.max(0, share));
  return Math.round((scale.low + inside * (scale.high - scale.low)) / snap) * snap;
}

/** Whole multiples of `step` on the scale. */
export function ticksOf(scale: Scale, step: number): number[] {
  const first = Math.ceil(scale.low / step);
  const last = Math.floor(scale.high / step);
  return Array.from({ length: last - first + 1 }, (_, at) => (first + at) * step);
}

/** The usual scale, widened by whole steps until it holds all values. */
export function scaleFor(usual: Scale, values: readonly number[], step: number): Scale {
  return {
    low: Math.min(usual.low, ...values.map((value) => Math.floor(value / step) * step)),
    high: Math.max(usual.high, ...values.map((value) => Math.ceil(value / step) * step)),
  };
}
