import type { SignalRun } from "../../../api/signals";
import { useTexts } from "../../../texts/texts";
import type { Line } from "./plotData";
import { ResponsePlot } from "./ResponsePlot";

const DEMAND: Line = { of: "set_point", colour: "--hs-warn", dash: [6, 4], width: 1.5, angle: true };
const POSITION: Line = { of: "position", colour: "--hs-accent", angle: true };
const EARLIER: Line = {
  of: "position",
  colour: "--hs-violet",
  dash: [2, 3],
  width: 1.75,
  angle: true,
  earlier: true,
};
const ANGLES: readonly Line[] = [DEMAND, POSITION];
const ANGLES_OVER: readonly Line[] = [DEMAND, POSITION, EARLIER];
const FOLLOWING: readonly Line[] = [{ of: "following", colour: "--hs-accent", width: 1.5 }];
const VELOCITY: readonly Line[] = [{ of: "velocity", colour: "--hs-accent", width: 1.5 }];
const CURRENT: readonly Line[] = [{ of: "current", colour: "--hs-accent", width: 1.5 }];

/** A run: angle over its set-point, following error, velocity and current; an earlier one laid over. */
export function RunPlots({ run, earlier }: { run: SignalRun; earlier: SignalRun | undefined }) {
  const t = useTexts();
  const plot = (key: string) => t(`page.signal.plot.${key}`);
  return (
    <div>
      <ResponsePlot
        run={run}
        earlier={earlier}
        lines={earlier ? ANGLES_OVER : ANGLES}
        title={plot("angle")}
        unit="°"
        height={210}
        leastSpan={0.2}
        testId="signal-plot-angle"
      />
      <ResponsePlot
        run={run}
        lines={FOLLOWING}
        title={plot("following")}
        unit="°"
        height={84}
        leastSpan={0.1}
        testId="signal-plot-following"
      />
      <ResponsePlot
        run={run}
        lines={VELOCITY}
        title={plot("velocity")}
        unit="°/s"
        height={84}
        leastSpan={1}
        testId="signal-plot-velocity"
      />
      <ResponsePlot
        run={run}
        lines={CURRENT}
        title={plot("current")}
        unit="%"
        height={84}
        leastSpan={10}
        testId="signal-plot-current"
      />
    </div>
  );
}
