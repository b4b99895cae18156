/** The last minutes of an axis: times in s, angles in degrees, velocity in degrees a second, current in per cent. */

/** So long is kept. */
export const KEPT_S = 300;
/** What the overview shows of it. */
export const TRACE_S = 60;
/** Where messages were missing for so long the line is broken, not drawn through. */
export const GAP_S = 1;
/** So much too old may be kept before it is cut off: cutting costs more than keeping. */
const SLACK_S = 20;

type Numbers = (number | null)[];

export interface Sample {
  positionDeg: number | null;
  demandDeg: number | null;
  velocityDps: number | null;
  currentPct: number | null;
}

const NOTHING: Sample = { positionDeg: null, demandDeg: null, velocityDps: null, currentPct: null };

export interface Columns {
  times: number[];
  positions: Numbers;
  demands: Numbers;
  velocities: Numbers;
  currents: Numbers;
}

export class Trace {
  private readonly all: Columns = { times: [], positions: [], demands: [], velocities: [], currents: [] };

  push(timeS: number, sample: Sample, gapS = GAP_S): void {
    const { times } = this.all;
    const last = times.at(-1);
    if (last !== undefined && timeS <= last) return;
    if (last !== undefined && timeS - last > gapS) this.append(last + 0.001, NOTHING);
    this.append(timeS, sample);
    if ((times[0] ?? timeS) < timeS - KEPT_S - SLACK_S) this.cut(timeS - KEPT_S);
  }

  /** What was before the first sample, oldest first. */
  prepend(earlier: Columns): void {
    const first = this.all.times[0] ?? Infinity;
    const found = earlier.times.findIndex((timeS) => timeS >= first);
    const count = found < 0 ? earlier.times.length : found;
    for (const [name, column] of Object.entries(this.all) as [keyof Columns, unknown[]][])
      column.unshift(...earlier[name].slice(0, count));
  }

  /** What lies in the `spanS` seconds before `endS`; by itself up to the latest sample. */
  columns(spanS: number, endS: number = this.all.times.at(-1) ?? 0): Columns {
    const from = this.indexOf(endS - spanS);
    const to = this.indexOf(endS) + 1;
    const { times, positions, demands, velocities, currents } = this.all;
    return {
      times: times.slice(from, to),
      positions: positions.slice(from, to),
      demands: demands.slice(from, to),
      velocities: velocities.slice(from, to),
      currents: currents.slice(from, to),
    };
  }

  private append(timeS: number, sample: Sample): void {
    this.all.times.push(timeS);
    this.all.positions.push(sample.positionDeg);
    this.all.demands.push(sample.demandDeg);
    this.all.velocities.push(sample.velocityDps);
    this.all.currents.push(sample.currentPct);
  }

  private cut(beforeS: number): void {
    const count = this.indexOf(beforeS);
    for (const column of Object.values(this.all) as unknown[][]) column.splice(0, count);
  }

  /** Index of the first sample that is not before `timeS`. */
  private indexOf(timeS: number): number {
    const { times } = this.all;
    let [low, high] = [0, times.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if ((times[middle] ?? 0) < timeS) low = middle + 1;
      else high = middle;
    }
    return low;
  }
}
