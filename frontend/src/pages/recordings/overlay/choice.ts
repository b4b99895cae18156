/**
 * What is laid over, as it stands in the URL. Recordings with their zeros, `<name>~<trip>` or `<name>@<t_ns>`; signals of
 * all of them, with a blade where only that one counts; seconds before and after the zero:
 *
 *     overlay=3-following-error~0;5-battery@1772442020000000000&curves=6064,60F4*2&window=10-20
 */
import type { AlignRequest } from "../../../api/overlay";

export interface Zero {
  /** Name of the file without its ending. */
  name: string;
  /** Place of the trip whose T0 it is, or the moment itself. */
  trip: number | null;
  tNs: string | null;
}

export interface Curve {
  address: string;
  /** Null is all blades. */
  blade: number | null;
}

export interface Span {
  beforeS: number;
  afterS: number;
}

export const USUAL_CURVES: readonly Curve[] = [
  { address: "6064", blade: null },
  { address: "60F4", blade: null },
];
export const USUAL_SPAN: Span = { beforeS: 10, afterS: 20 };
export const MAX_CURVES = 16;
const POINTS_A_PX = 1;
const MOST_POINTS = 4000;
const LEAST_POINTS = 100;

export const zeroText = ({ name, trip, tNs }: Zero): string =>
  trip === null ? `${name}@${tNs ?? ""}` : `${name}~${trip}`;
export const zerosText = (zeros: readonly Zero[]): string => zeros.map(zeroText).join(";");

/** Takes what is valid and leaves the rest; a recording has one zero. */
export function parseZeros(text: string): Zero[] {
  const found = new Map<string, Zero>();
  for (const one of text.split(";")) {
    const match = /^(.+?)(?:~(\d{1,5})|@(\d{1,19}))$/.exec(one);
    const [, name, trip, tNs] = match ?? [];
    if (name !== undefined)
      found.set(name, { name, trip: trip === undefined ? null : Number(trip), tNs: tNs ?? null });
  }
  return [...found.values()];
}

const curveText = ({ address, blade }: Curve): string => (blade === null ? address : `${address}*${blade}`);
export const curvesText = (curves: readonly Curve[]): string => curves.map(curveText).join();

export function parseCurve(text: string): Curve | null {
  const match = /^([0-9A-F]{4}(?::[0-9A-F]{2})?)(?:\*([1-9]))?$/i.exec(text.trim());
  if (!match) return null;
  return { address: (match[1] ?? "").toUpperCase(), blade: match[2] === undefined ? null : Number(match[2]) };
}

export function parseCurves(text: string): Curve[] {
  const found = new Map<string, Curve>();
  for (const one of text.split(",")) {
    const curve = parseCurve(one);
    if (curve) found.set(curveText(curve), curve);
  }
  return [...found.values()].slice(0, MAX_CURVES);
}

export const spanText = ({ beforeS, afterS }: Span): string => `${beforeS}-${afterS}`;

export function parseSpan(text: string): Span | null {
  const match = /^(\d+(?:\.\d+)?)-(\d+(?:\.\d+)?)$/.exec(text);
  const [beforeS, afterS] = [Number(match?.[1]), Number(match?.[2])];
  return beforeS >= 0 && afterS > 0 && Math.max(beforeS, afterS) <= 3600 ? { beforeS, afterS } : null;
}

export const fileOf = (name: string): string => `${name}.mcap`;

export function requestOf(
  zeros: readonly Zero[],
  curves: readonly Curve[],
  span: Span,
  widthPx: number,
): AlignRequest {
  return {
    recordings: zeros.map(({ name, trip, tNs }) => ({
      name: fileOf(name),
      trip,
      t_ns: tNs === null ? null : Number(tNs),
    })),
    signals: curves.map(({ address, blade }) => ({ address, blade, device: null, bus: null, node: null })),
    before_ms: span.beforeS * 1000,
    after_ms: span.afterS * 1000,
    points: Math.min(MOST_POINTS, Math.max(LEAST_POINTS, Math.round(widthPx * POINTS_A_PX))),
  };
}
