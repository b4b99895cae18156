import { spanAt } from "../../../model/tracks";
import { useTexts } from "../../../texts/texts";
import classes from "./Scope.module.css";
import { ScaleSetting } from "./ScaleSetting";
import { Swatch } from "./Swatch";
import { BITS, numberText, type PlotGroup, spanText, type Trace, valueAt } from "./traces";
import type { Pair } from "./view";

interface Props {
  group: PlotGroup;
  cursors: Pair | null;
  hoverS: number | null;
  /** All that is shown is of one device: its name need not be said again and again. */
  alone: boolean;
  scale: Pair | null;
  shown: () => Pair;
  onScale: (scale: Pair | null) => void;
}

/** Above a plot: its unit, and of each signal in it the value at the pointer, or at both cursors and their difference. */
export function PlotHead({ group, cursors, hoverS, alone, ...scale }: Props) {
  const t = useTexts();
  if (group.key === BITS) return <p className={classes.plotHead}>{t("page.scope.plot_bits")}</p>;
  return (
    <div className={`${classes.plotHead} bench`}>
      <ScaleSetting group={group} {...scale} />
      {group.traces
        .filter((one) => one.reference === null)
        .map((trace) => (
          <span key={trace.name} className={classes.chip}>
            <Swatch colour={trace.colour} dash={trace.dash} />
            {alone ? trace.short : trace.label}
            {cursors === null ? (
              <output>{hoverS === null ? "" : spanText(spanAt(trace.track, hoverS), trace, t)}</output>
            ) : (
              <AtCursors trace={trace} cursors={cursors} />
            )}
          </span>
        ))}
    </div>
  );
}

function AtCursors({ trace, cursors }: { trace: Trace; cursors: Pair }) {
  const t = useTexts();
  const [a, b] = [valueAt(trace, cursors[0]), valueAt(trace, cursors[1])];
  const delta = a === null || b === null ? "–" : numberText(b - a, trace.decimals, t);
  return (
    <output>
      <small>A</small> {spanText(spanAt(trace.track, cursors[0]), trace, t)} <small>B</small>{" "}
      {spanText(spanAt(trace.track, cursors[1]), trace, t)} <small>Δ</small> {delta}
    </output>
  );
}
