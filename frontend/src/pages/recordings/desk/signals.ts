/** The signals of a recording as the desk shows them: named, grouped, with what is needed to read and to draw them. */
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { useTurbineQuery } from "../../../api/queries";
import { type SignalLine, signalsQuery } from "../../../api/replay";
import type { EntryDoc } from "../../../api/types";
import type { DeviceContext } from "../../../model/shown";
import { isHex, localise, quantityOf } from "../../../model/values";
import type { Span } from "../../../model/tracks";
import { type Translate, useTexts } from "../../../texts/texts";
import { type Place, placesOf, stationName } from "../../../ui/devices";
import { useContexts } from "../../parameters/devicesOf";

export interface DeskSignal {
  /** Without the turbine: `blade-2/pmc/6064`. */
  name: string;
  line: SignalLine;
  entry: EntryDoc;
  context: DeviceContext;
  /** Name of the object: "position actual value". */
  title: string;
  station: string;
  /** "Blade 2", and "Blade 2 PMC". */
  stationTitle: string;
  deviceTitle: string;
  groupTitle: string;
  blade: number | null;
  unit: string;
  decimals: number;
  /** Between two values the last one holds: drawn in steps. */
  held: boolean;
  /** Lower case text that a filter searches. */
  haystack: string;
}

/** Values that come less often than this are drawn as what holds until the next. */
const SLOW_S = 0.25;

export const nameOf = ({ device, address }: Pick<SignalLine, "device" | "address">): string =>
  `${device.slice(device.indexOf("/") + 1)}/${address}`;

/** All signals by name, in the order of devices, groups and addresses; null until they are known. */
export function useSignals(replay: string): ReadonlyMap<string, DeskSignal> | null {
  const t = useTexts();
  const lines = useQuery(signalsQuery(replay)).data;
  const turbine = useQuery(useTurbineQuery()).data;
  const places = useMemo(() => placesOf(turbine), [turbine]);
  const contexts = useContexts(places);
  return useMemo(() => {
    if (lines === undefined || places.length === 0 || contexts.size === 0) return null;
    return new Map(
      places.flatMap((place) => ofDevice(place, lines, contexts, t)).map((one) => [one.name, one]),
    );
  }, [lines, places, contexts, t]);
}

function ofDevice(
  place: Place,
  lines: readonly SignalLine[],
  contexts: ReadonlyMap<string, DeviceContext>,
  t: Translate,
): DeskSignal[] {
  const context = contexts.get(place.device.slug);
  if (context === undefined) return [];
  const groups = new Map(context.doc.groups.map((group, at) => [group.id, { at, title: t(group.text_key) }]));
  const entries = new Map(context.doc.entries.map((entry) => [entry.address, entry]));
  const found = lines
    .filter((line) => line.device === place.device.slug)
    .flatMap((line) => {
      const entry = entries.get(line.address);
      return entry ? [signalOf(line, entry, place, context, groups.get(entry.group)?.title ?? "", t)] : [];
    });
  const rank = (one: DeskSignal) => groups.get(one.entry.group)?.at ?? groups.size;
  return found.sort((a, b) => rank(a) - rank(b) || (a.line.address < b.line.address ? -1 : 1));
}

function signalOf(
  line: SignalLine,
  entry: EntryDoc,
  { station, device }: Place,
  context: DeviceContext,
  groupTitle: string,
  t: Translate,
): DeskSignal {
  const title = t.nameOf(entry.title);
  const stationTitle = stationName(station, t);
  const deviceTitle = `${stationTitle} ${device.name}`;
  const apartS = line.count > 1 ? (line.last_s - line.first_s) / (line.count - 1) : Infinity;
  return {
    name: nameOf(line),
    line,
    entry,
    context,
    title,
    station: station.slug,
    stationTitle,
    deviceTitle,
    groupTitle,
    blade: station.blade,
    unit: line.unit,
    decimals: quantityOf(entry, context.lookup).decimals,
    held: line.states !== null || isHex(entry) || apartS > SLOW_S,
    haystack:
      `${title} ${line.address} ${deviceTitle} ${groupTitle} ${line.unit} ${entry.title}`.toLowerCase(),
  };
}

const MINUS = "−";

/** A number of this signal, or what a state is called; `5.01…5.20` where it is only known to lie between. */
export function textOfSpan(signal: DeskSignal, span: Span | null, t: Translate): string {
  if (span === null) return "–";
  const one = (number: number) => textOfNumber(signal, number, t);
  return one(span.low) === one(span.high) ? one(span.low) : `${one(span.low)}…${one(span.high)}`;
}

export function textOfNumber({ line, entry, decimals }: DeskSignal, number: number, t: Translate): string {
  const state = line.states?.[String(number)];
  if (state !== undefined) return t(state);
  if (isHex(entry))
    return `${(number < 0 ? number + 2 ** (entry.bit_count ?? 32) : number).toString(16).toUpperCase()}h`;
  return localise(number.toFixed(decimals).replace("-", MINUS), t.language);
}
