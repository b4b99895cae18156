/** The last 60 s of an axis: times in s, positions in degrees; null is a gap. */

export const TRACE_S = 60;

export class Trace {
  private readonly times: number[] = [];
  private readonly positions: (number | null)[] = [];
  private readonly demands: (number | null)[] = [];

  push(timeS: number, positionDeg: number | null, demandDeg: number | null): void {
    const last = this.times.at(-1);
    if (last !== undefined && timeS <= last) return;
    // Where messages were missing the line is broken, not drawn through.
    if (last !== undefined && timeS - last > 1) this.append(last + 0.001, null, null);
    this.append(timeS, positionDeg, demandDeg);
    const first = this.times.findIndex((time) => time >= timeS - TRACE_S);
    if (first > 0) for (const column of [this.times, this.positions, this.demands]) column.splice(0, first);
  }

  columns(): [number[], (number | null)[], (number | null)[]] {
    return [[...this.times], [...this.positions], [...this.demands]];
  }

  private append(timeS: number, positionDeg: number | null, demandDeg: number | null): void {
    this.times.push(timeS);
    this.positions.push(positionDeg);
    this.demands.push(demandDeg);
  }
}
