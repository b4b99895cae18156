/** What a scope can show: the numbers of all devices and the named bits of their words, the common ones first. */
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { useTurbineQuery } from "../../../api/queries";
import type { BitDoc, EntryDoc } from "../../../api/types";
import type { DeviceContext } from "../../../model/shown";
import { isFloat, isInteger, quantityOf } from "../../../model/values";
import { type Translate, useTexts } from "../../../texts/texts";
import { keyOf } from "../stations";
import { type Place, placesOf, stationName } from "../../../ui/devices";
import { useContexts } from "../../parameters/devicesOf";

export interface SignalOption {
  /** `wtg-07/blade-1/pmc/6041.3` */
  name: string;
  device: string;
  address: string;
  bit: number | null;
  /** "Position actual value", "statusword: fault". */
  title: string;
  /** "Blade 1 PMC". */
  place: string;
  unit: string;
  /** The entry has bits, each of which is a signal of its own. */
  word: boolean;
  haystack: string;
}

/** The objects that a technician looks at first. */
const COMMON = [
  "6064",
  "607A",
  "606C",
  "6078",
  "60F4",
  "6079",
  "3063",
  "3062",
  "6041",
  "6040",
  "60FD",
  "3000",
];

const PRESETS = {
  motion: ["pmc/6064", "pmc/607A", "pmc/606C", "pmc/6078", "pmc/6041.2", "pmc/6041.3"],
  following: ["pmc/60F4", "pmc/6064", "pmc/607A", "pmc/606C"],
  supply: ["pmc/6079", "pmm/3063", "pmm/3062", "pmm/3060", "pmm/3070"],
  switches: ["pmc/6064", "pmc/60FD", "pmc/60FE:03", "pmc/6041.3", "pmc/6041.11"],
} as const;

export type Preset = keyof typeof PRESETS;
export const PRESET_NAMES = Object.keys(PRESETS) as Preset[];

export interface Options {
  all: readonly SignalOption[];
  byName: ReadonlyMap<string, SignalOption>;
  devices: readonly { value: string; label: string }[];
  axes: readonly string[];
}

const NO_OPTIONS: Options = { all: [], byName: new Map(), devices: [], axes: [] };

/** All of them; those of the blade that the room shows come first. */
export function useOptions(blade: string | undefined): Options {
  const t = useTexts();
  const turbine = useQuery(useTurbineQuery()).data;
  const places = useMemo(() => placesOf(turbine), [turbine]);
  const contexts = useContexts(places);
  return useMemo(() => {
    const first = places[0];
    if (first === undefined || contexts.size === 0) return NO_OPTIONS;
    const shown = blade ?? keyOf(first.station);
    const own = (place: Place) => Number(keyOf(place.station) !== shown);
    const sorted = places.toSorted((a, b) => own(a) - own(b));
    const all = sorted.flatMap((place) => ofDevice(place, contexts.get(place.device.slug), t));
    all.sort((a, b) => rank(a) - rank(b));
    return {
      all,
      byName: new Map(all.map((one) => [one.name, one])),
      devices: places.map((place) => ({
        value: place.device.slug,
        label: `${stationName(place.station, t)} ${place.device.name}`,
      })),
      axes: all.filter((one) => one.address === "6040" && one.bit === null).map((one) => one.device),
    };
  }, [places, contexts, blade, t]);
}

function rank({ address, bit }: SignalOption): number {
  const at = COMMON.indexOf(address);
  if (at < 0) return 1000;
  return bit === null ? at : 100 + at;
}

function ofDevice(place: Place, context: DeviceContext | undefined, t: Translate): SignalOption[] {
  if (!context) return [];
  const where = `${stationName(place.station, t)} ${place.device.name}`;
  return context.doc.entries
    .filter((entry) => entry.readable && (isInteger(entry) || isFloat(entry)))
    .flatMap((entry) => {
      const bits = entry.bits === null ? [] : (context.doc.bit_tables[entry.bits] ?? []);
      const single = bits.filter((bit) => bit.bit === bit.last);
      return [
        whole(entry, context, where, bits.length > 0, t),
        ...single.map((bit) => ofBit(entry, bit, context, where, t)),
      ];
    });
}

function whole(
  entry: EntryDoc,
  context: DeviceContext,
  where: string,
  word: boolean,
  t: Translate,
): SignalOption {
  const { unit } = quantityOf(entry, context.lookup);
  const title = t.nameOf(entry.title);
  return {
    name: `${context.slug}/${entry.address}`,
    device: context.slug,
    address: entry.address,
    bit: null,
    title,
    place: where,
    unit,
    word,
    haystack: `${title} ${entry.title} ${entry.address} ${where} ${unit}`.toLowerCase(),
  };
}

function ofBit(
  entry: EntryDoc,
  bit: BitDoc,
  context: DeviceContext,
  where: string,
  t: Translate,
): SignalOption {
  const object = t.nameOf(entry.title);
  const title = `${object}: ${bit.clamp ?? t(bit.text_key)}`;
  return {
    name: `${context.slug}/${entry.address}.${bit.bit}`,
    device: context.slug,
    address: entry.address,
    bit: bit.bit,
    title,
    place: where,
    unit: "",
    word: false,
    haystack:
      `${title} ${t(bit.text_key)} ${entry.title} ${entry.address} ${where} bit ${bit.bit}`.toLowerCase(),
  };
}

/** Those in which all words are found. */
export function found(options: readonly SignalOption[], words: string): SignalOption[] {
  const parts = words
    .toLowerCase()
    .split(/\s+/)
    .filter((part) => part !== "");
  return options.filter(({ haystack }) => parts.every((part) => haystack.includes(part)));
}

/** The signals of a preset at a station, as far as its devices have them. */
export function presetOf(preset: Preset, station: string, options: Options): string[] {
  const here = new Set(
    options.all.filter(({ device }) => device.startsWith(`${station}/`)).map((one) => one.device),
  );
  return PRESETS[preset]
    .flatMap((end) => {
      const [device, signal] = end.split("/");
      const named = `${station}/${device}`;
      // A station with other devices than those of a blade: whichever has the object.
      return here.has(named) ? [`${named}/${signal}`] : [...here].map((one) => `${one}/${signal}`);
    })
    .filter((name) => options.byName.has(name));
}
