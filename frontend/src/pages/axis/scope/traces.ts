/** The signals of a capture as they are drawn: grouped by unit, bits in lanes of their own, references dashed. */
import type { KeptSignal, ScopeSeries, SignalRate } from "../../../api/scope";
import { joined, type Span, spanAt, spanIn, type Track, trackOf } from "../../../model/tracks";
import { localise } from "../../../model/values";
import type { Translate } from "../../../texts/texts";

export interface Trace {
  name: string;
  /** "Blade 1 PMC position actual value". */
  label: string;
  device: string;
  /** "Position actual value". */
  short: string;
  unit: string;
  bit: boolean;
  /** Number of the colour, 0 to 7. */
  colour: number;
  dash: readonly number[];
  decimals: number;
  track: Track;
  /** Name of the capture that is laid over; null: of the one that is shown. */
  reference: string | null;
}

export interface PlotGroup {
  /** Unit, or "bits". */
  key: string;
  unit: string;
  traces: readonly Trace[];
}

export const COLOURS = 8;
export const BITS = "bits";
/** In the URL: each signal has an axis of its own. */
export const EACH = "each";
const REFERENCE_DASHES: readonly (readonly number[])[] = [
  [7, 4],
  [2, 3],
  [10, 3, 2, 3],
];
export const MAX_REFERENCES = REFERENCE_DASHES.length;
const SOLID: readonly number[] = [];
const LANE = 0.68;
const MARGIN = 0.07;
const LEAST_STEPS = 12;

export type Described = KeptSignal | SignalRate;

/** What a signal is called: device, object, bit. */
function labelOf(signal: Described, deviceName: (slug: string) => string, t: Translate): string {
  return `${deviceName(signal.device)} ${shortOf(signal, t)}`;
}

function shortOf(signal: Described, t: Translate): string {
  const bit =
    signal.bit === null
      ? ""
      : `: ${signal.bit_key === null ? t("page.scope.bit", { bit: signal.bit }) : t(signal.bit_key)}`;
  return `${t.nameOf(signal.title)}${bit}`;
}

export const decimalsOf = (scale: string): number =>
  scale.includes(".") ? (scale.split(".")[1]?.length ?? 0) : 0;

/** Traces of signals with their values, in the order and colours of the signals. */
export function tracesOf(
  signals: readonly Described[],
  series: readonly ScopeSeries[],
  deviceName: (slug: string) => string,
  t: Translate,
): Trace[] {
  const byName = new Map(series.map((one) => [one.signal, one]));
  return signals.flatMap((signal, at) => {
    const values = byName.get(signal.name);
    if (!values) return [];
    return [
      {
        name: signal.name,
        label: labelOf(signal, deviceName, t),
        device: signal.device,
        short: shortOf(signal, t),
        unit: signal.unit,
        bit: signal.bit !== null,
        colour: at % COLOURS,
        dash: SOLID,
        decimals: decimalsOf(signal.scale),
        track: trackOf(values),
        reference: null,
      },
    ];
  });
}

/** What of a reference is a signal of the capture that is shown, too; also of another turbine. */
export function referenceTraces(
  own: readonly Trace[],
  series: readonly ScopeSeries[],
  name: string,
  at: number,
): Trace[] {
  const place = (full: string) => full.slice(full.indexOf("/") + 1);
  const byPlace = new Map(series.map((one) => [place(one.signal), one]));
  return own.flatMap((trace) => {
    const values = byPlace.get(place(trace.name));
    if (!values) return [];
    const dash = REFERENCE_DASHES[at % REFERENCE_DASHES.length] ?? SOLID;
    return [{ ...trace, track: trackOf(values), dash, reference: name }];
  });
}

/** `each`: a plot with its own scale for each signal; else one for all of a unit. */
export function groupsOf(traces: readonly Trace[], each: boolean): PlotGroup[] {
  const keyOf = (one: Trace) => (each ? `signal ${one.name}` : `unit ${one.unit}`);
  const numbers = traces.filter((one) => !one.bit);
  const groups = [...new Set(numbers.map(keyOf))].map((key) => {
    const own = numbers.filter((one) => keyOf(one) === key);
    return { key, unit: own[0]?.unit ?? "", traces: own };
  });
  const bits = traces.filter((one) => one.bit);
  return bits.length === 0 ? groups : [...groups, { key: BITS, unit: "", traces: bits }];
}

/** The names in a group, each once: lanes of bits. */
export const namesIn = (group: PlotGroup): string[] => [...new Set(group.traces.map((one) => one.name))];

/** Where a bit is drawn: its lane counted from the top. */
export const laneValue = (lane: number, lanes: number, value: number): number =>
  lanes - 1 - lane + (1 - LANE) / 2 + value * LANE;

/** Limits of the axis over what is in view. */
export function limitsOf(group: PlotGroup, fromS: number, toS: number): [number, number] {
  if (group.key === BITS) return [0, namesIn(group).length];
  const span = joined(group.traces.map(({ track }) => spanIn(track, fromS, toS)));
  const { low, high } = span ?? { low: 0, high: 1 };
  const decimals = Math.max(...group.traces.map((one) => one.decimals));
  const least = Math.max(LEAST_STEPS * 10 ** -decimals, 0.01 * Math.max(Math.abs(low), Math.abs(high)));
  const half = Math.max(least, (high - low) * (1 + 2 * MARGIN)) / 2;
  const middle = (low + high) / 2;
  return [middle - half, middle + half];
}

export const numberText = (value: number, decimals: number, t: Translate): string =>
  localise(value.toFixed(decimals).replace("-", "−"), t.language);

export function spanText(span: Span | null, trace: Trace, t: Translate): string {
  if (span === null) return "–";
  const [low, high] = [numberText(span.low, trace.decimals, t), numberText(span.high, trace.decimals, t)];
  return low === high ? low : `${low}…${high}`;
}

/** The value last seen at a time, where it is one. */
export function valueAt(trace: Trace, atS: number): number | null {
  const span = spanAt(trace.track, atS);
  return span === null ? null : (span.low + span.high) / 2;
}

export const secondsText = (atS: number, t: Translate, decimals = 4): string =>
  localise(atS.toFixed(decimals).replace("-", "−"), t.language);
