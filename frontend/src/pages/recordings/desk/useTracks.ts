/**
 * The signals that are drawn, over time: in the stretch in view and as much beside it, in about as many points as there
 * are pixels. Until another stretch has come, what is there stays drawn. What has few values is fetched once and whole.
 */
import { useDebouncedValue } from "@mantine/hooks";
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { type SeriesLine, seriesQuery } from "../../../api/replay";
import { type Track, trackOf, withHoles } from "../../../model/tracks";
import type { Stretch } from "../../../replay/looking";
import { secondsOf } from "./place";
import { type DeskSignal, nameOf } from "./signals";

const WHOLE_COUNT = 1500;
const POINTS_A_PX = 1.5;
const MAX_POINTS = 20_000;
const WIDTH_STEP_PX = 200;
const SETTLES_MS = 80;

/** Made when a line is first seen, while it is known how far it was asked for. */
const known = new WeakMap<SeriesLine, Track>();

function trackOfLine(line: SeriesLine, held: boolean, endS: number): Track {
  const found = known.get(line);
  if (found) return found;
  const track = held ? trackOf(line) : withHoles(trackOf(line), endS);
  known.set(line, track);
  return track;
}

/** A stretch around the one in view, on a grid so that it stays the same while little is moved; in `points`. */
export function fetched(view: Stretch, whole: Stretch, widthPx: number) {
  const length = view.toNs - view.fromNs;
  const step = 2 ** Math.floor(Math.log2(length / 2));
  const fromNs = Math.max(whole.fromNs, Math.floor((view.fromNs - length / 2) / step) * step);
  const toNs = Math.min(whole.toNs + 1, Math.ceil((view.toNs + length / 2) / step) * step);
  const width = Math.ceil(widthPx / WIDTH_STEP_PX) * WIDTH_STEP_PX;
  const points = Math.ceil(((toNs - fromNs) / length) * width * POINTS_A_PX);
  return { fromNs, toNs, points: Math.min(MAX_POINTS, points) };
}

export function useTracks(
  replay: string,
  signals: readonly DeskSignal[],
  view: Stretch,
  whole: Stretch,
  widthPx: number,
): ReadonlyMap<string, Track> {
  const [settled] = useDebouncedValue(view, SETTLES_MS);
  const named = (few: boolean) =>
    [
      ...new Set(
        signals
          .filter(({ line }) => line.count <= WHOLE_COUNT === few)
          .map(({ line }) => `${line.device}/${line.address}`),
      ),
    ].sort();
  const part = fetched(settled, whole, widthPx);
  const few = useQuery(
    seriesQuery(replay, { signals: named(true), fromNs: null, toNs: null, points: WHOLE_COUNT }),
  ).data;
  const many = useQuery(seriesQuery(replay, { signals: widthPx > 0 ? named(false) : [], ...part })).data;
  return useMemo(() => {
    const held = new Map(signals.map((one) => [one.name, one.held]));
    const told = (lines: readonly SeriesLine[] | undefined, toNs: number) =>
      (lines ?? []).map((line): [string, Track] => {
        const name = nameOf(line);
        return [name, trackOfLine(line, held.get(name) ?? true, secondsOf(toNs, whole))];
      });
    return new Map([...told(few, whole.toNs), ...told(many, Math.min(whole.toNs, part.toNs))]);
  }, [few, many, signals, whole, part.toNs]);
}
