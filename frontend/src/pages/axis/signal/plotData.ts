/** Courses of runs as one table for a plot: times in s, degrees from where the blade stood. */
import UPlot from "uplot";
import type { Course, SignalRun } from "../../../api/signals";

export interface Line {
  /** Course of the run, and the end of its text key `page.signal.course.…`. */
  of: string;
  colour: string;
  dash?: number[];
  width?: number;
  stepped?: boolean;
  /** Of the run that is laid over. */
  earlier?: boolean;
  /** An angle, shown from where the blade stood. */
  angle?: boolean;
}

export function table(
  run: SignalRun,
  earlier: SignalRun | undefined,
  lines: readonly Line[],
): UPlot.AlignedData {
  const tables = lines.map((line): UPlot.AlignedData => {
    const source = line.earlier ? earlier : run;
    const course: Course | undefined = source?.courses[line.of];
    if (!source || !course) return [[], []];
    const from = line.angle ? source.start_deg : 0;
    return [course.t_ms.map((ms) => ms / 1000), course.y.map((y) => y - from)];
  });
  return UPlot.join(tables);
}
