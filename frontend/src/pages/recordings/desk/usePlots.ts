/** The plots of the desk as they stand in the URL, and what changes them. */
import { useMemo } from "react";
import { usePageSearch } from "../../../frame/search";
import type { DeskSignal } from "./signals";
import {
  changed,
  moved,
  parseView,
  type PlotSpec,
  usualView,
  viewText,
  withoutSignal,
  withSignal,
} from "./view";

export interface Plots {
  list: readonly PlotSpec[];
  /** As it stands in the URL; that of the usual view where nothing stands there. */
  text: string;
  usual: string;
  show: (text: string) => void;
  add: (signal: string, at: number | null) => void;
  remove: (signal: string, at: number) => void;
  drop: (at: number) => void;
  move: (from: number, to: number) => void;
  change: (at: number, change: Partial<PlotSpec>) => void;
  /** Shows the signal where others of its unit are, or in a plot of its own; takes it out where it is shown. */
  toggle: (signal: DeskSignal) => void;
}

const NONE = "none";

export function usePlots(signals: ReadonlyMap<string, DeskSignal>): Plots {
  const [search, update] = usePageSearch();
  const usual = useMemo(() => viewText(usualView(new Set(signals.keys()))), [signals]);
  const text = search.plots === NONE ? "" : (search.plots ?? usual);
  return useMemo(() => {
    const list = parseView(text);
    const show = (next: string) => update({ plots: next === usual ? undefined : next === "" ? NONE : next });
    const put = (plots: readonly PlotSpec[]) => show(viewText(plots));
    const unitOf = (plot: PlotSpec) => signals.get(plot.signals[0] ?? "")?.unit;
    return {
      list,
      text,
      usual,
      show,
      add: (signal, at) => put(withSignal(list, signal, at)),
      remove: (signal, at) => put(withoutSignal(list, signal, at)),
      drop: (at) => put(list.toSpliced(at, 1)),
      move: (from, to) => put(moved(list, from, to)),
      change: (at, change) => put(changed(list, at, change)),
      toggle: ({ name, unit }) => {
        const shown = list.some((plot) => plot.signals.includes(name));
        if (shown)
          put(list.reduce((plots, _, at) => withoutSignal(plots, name, list.length - 1 - at), [...list]));
        else {
          const at = list.findIndex((plot) => unitOf(plot) === unit && !plot.band);
          put(withSignal(list, name, at < 0 ? null : at));
        }
      },
    };
  }, [text, usual, signals, update]);
}
