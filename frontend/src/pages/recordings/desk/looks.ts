/** How the signals of a plot are told apart: blades by colour, objects of a blade by the dash of the line. */
import type { DeskSignal } from "./signals";

export interface Look {
  /** Number of the colour, 0 to 7. */
  colour: number;
  dash: readonly number[];
}

export const COLOURS = 8;
const DASHES: readonly (readonly number[])[] = [[], [6, 4], [2, 3], [9, 3, 2, 3]];

export function looksOf(signals: readonly DeskSignal[]): ReadonlyMap<string, Look> {
  const stations = [...new Set(signals.map((one) => one.station))];
  const objects = [
    ...new Set(signals.map((one) => `${one.line.device.split("/").at(-1)} ${one.line.address}`)),
  ];
  const alone = stations.length === 1;
  return new Map(
    signals.map((one, at) => {
      const object = objects.indexOf(`${one.line.device.split("/").at(-1)} ${one.line.address}`);
      const place = one.blade === null ? stations.indexOf(one.station) : one.blade - 1;
      const colour = (alone ? at : place) % COLOURS;
      return [one.name, { colour, dash: alone ? [] : (DASHES[object % DASHES.length] ?? []) }];
    }),
  );
}

/** The units of a plot, each with its axis, in the order of the signals. */
export const unitsOf = (signals: readonly DeskSignal[]): string[] => [
  ...new Set(signals.map((one) => one.unit)),
];
