/** The value axes that were set by hand, as they stand in the URL: the key of a plot and its limits. */
import { type Pair, pairText, parsePair } from "./view";

export type Scales = ReadonlyMap<string, Pair>;

/** Of "unit%20mm:0..20;unit%20%C2%B0:-5..5"; what is no such pair, or upside down, is left out. */
export function parseScales(text: string | undefined): Scales {
  const parts = (text ?? "").split(";").map((one) => one.split(":"));
  return new Map(
    parts.flatMap(([key, limits]) => {
      const pair = parsePair(limits);
      return key === undefined || pair === null || pair[0] >= pair[1] ? [] : [[keyOf(key), pair] as const];
    }),
  );
}

/** Undefined where all axes are automatic. */
export function scalesText(scales: Scales): string | undefined {
  const parts = [...scales].map(([key, pair]) => `${encodeURIComponent(key)}:${pairText(pair)}`);
  return parts.length === 0 ? undefined : parts.join(";");
}

/** `scales` with another axis of the plot `key`; null: automatic again. */
export function withScale(scales: Scales, key: string, pair: Pair | null): Scales {
  const others = [...scales].filter(([name]) => name !== key);
  return new Map(pair === null ? others : [...others, [key, pair]]);
}

function keyOf(text: string): string {
  try {
    return decodeURIComponent(text);
  } catch {
    return text; // a link that was cut off: no plot has that key
  }
}
