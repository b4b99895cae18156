/**
 * What the plots of a replay show, as it stands in the URL and is kept under a name. Signals are named without their
 * turbine (`blade-2/pmc/6064`), so that a view fits any turbine of the kind:
 *
 *     band!blade-1/pmc/6064,blade-2/pmc/6064;blade-1/pmm/3063@500..700
 */

export interface PlotSpec {
  /** `<station>/<device>/<address>` each. */
  signals: readonly string[];
  /** Shows how far its signals disagree. */
  band: boolean;
  /** Limits of its first axis; null: as its signals are. */
  range: readonly [number, number] | null;
}

const BAND = "band!";
const SIGNAL = /^[^/]+\/[^/]+\/.+$/;
const RANGE = /^(-?[\d.]+)\.\.(-?[\d.]+)$/;

const plotText = ({ signals, band, range }: PlotSpec): string =>
  `${band ? BAND : ""}${signals.join()}${range ? `@${range[0]}..${range[1]}` : ""}`;

export const viewText = (plots: readonly PlotSpec[]): string => plots.map(plotText).join(";");

/** Takes what is valid and leaves the rest: a damaged link opens all the same. */
export function parseView(text: string): PlotSpec[] {
  return text.split(";").flatMap((one) => {
    const band = one.startsWith(BAND);
    const [names = "", limits = ""] = (band ? one.slice(BAND.length) : one).split("@");
    const signals = [...new Set(names.split(",").filter((name) => SIGNAL.test(name)))];
    return signals.length === 0 ? [] : [{ signals, band, range: parseRange(limits) }];
  });
}

function parseRange(text: string): PlotSpec["range"] {
  const match = RANGE.exec(text);
  const [low, high] = [Number(match?.[1]), Number(match?.[2])];
  return low < high ? [low, high] : null;
}

/** What a plot shows of every blade that has it: the first of these addresses that was seen. */
const USUAL: readonly { signals: readonly (readonly [device: string, address: string])[]; band: boolean }[] =
  [
    {
      signals: [
        ["pmc", "6064"],
        ["pmc", "607A"],
      ],
      band: true,
    },
    { signals: [["pmm", "3063"]], band: false },
    {
      signals: [
        ["pmm", "3060"],
        ["pmm", "3070"],
      ],
      band: false,
    },
    { signals: [["pmc", "60F4"]], band: false },
  ];

/** Position against demand, DC link, battery and following error of all blades, as far as they were seen. */
export function usualView(known: ReadonlySet<string>): PlotSpec[] {
  const stations = [...new Set([...known].map((name) => name.split("/")[0] ?? ""))].sort();
  return USUAL.flatMap(({ signals, band }) => {
    const found = signals.flatMap(([device, address]) =>
      stations.map((station) => `${station}/${device}/${address}`).filter((name) => known.has(name)),
    );
    return found.length === 0 ? [] : [{ signals: found, band, range: null }];
  });
}

/** The signal in this plot, or in a new one below the others; where it stands there already nothing changes. */
export function withSignal(plots: readonly PlotSpec[], signal: string, at: number | null): PlotSpec[] {
  if (at === null) return [...plots, { signals: [signal], band: false, range: null }];
  return plots.map((plot, n) =>
    n === at && !plot.signals.includes(signal) ? { ...plot, signals: [...plot.signals, signal] } : plot,
  );
}

/** A plot without signals is none. */
export function withoutSignal(plots: readonly PlotSpec[], signal: string, at: number): PlotSpec[] {
  return plots
    .map((plot, n) => (n === at ? { ...plot, signals: plot.signals.filter((one) => one !== signal) } : plot))
    .filter((plot) => plot.signals.length > 0);
}

export function moved(plots: readonly PlotSpec[], from: number, to: number): PlotSpec[] {
  const plot = plots[from];
  if (plot === undefined || to < 0 || to >= plots.length) return [...plots];
  return plots.toSpliced(from, 1).toSpliced(to, 0, plot);
}

export const changed = (plots: readonly PlotSpec[], at: number, change: Partial<PlotSpec>): PlotSpec[] =>
  plots.map((plot, n) => (n === at ? { ...plot, ...change } : plot));
