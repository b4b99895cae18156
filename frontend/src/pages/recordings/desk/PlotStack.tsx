import { useQuery } from "@tanstack/react-query";
import { useCallback, useEffect, useMemo, useRef, useState } from "react";
import type { KeyboardEvent } from "react";
import { type ReplayDoc, timelineQuery, tripsQuery } from "../../../api/replay";
import { useStore, useWatchDevice } from "../../../live/live";
import { type Stretch, useLooking, useWindow } from "../../../replay/looking";
import { useReplay } from "../../../replay/opening";
import { tickText } from "../../../replay/clockText";
import { placeOf, ticksOf, windowOf, zoomed } from "../../../replay/timelineView";
import { useTexts } from "../../../texts/texts";
import classes from "./Desk.module.css";
import { useDrop } from "./drag";
import { Selecting, Selection, useGestures } from "./gestures";
import { unitsOf } from "./looks";
import { Marks, TimeAtPointer } from "./Marks";
import { areaPx, LEFT_PX, type Room } from "./place";
import { TICK_PX } from "./Plot";
import { PlotRow } from "./PlotRow";
import type { DeskSignal } from "./signals";
import { useTracks } from "./useTracks";
import type { Plots } from "./usePlots";

const BUCKETS = 400;
const ZOOM_KEY = 0.5;
const LEGEND_PX = 228;
const NOTHING: readonly never[] = [];

interface Props {
  doc: ReplayDoc;
  signals: ReadonlyMap<string, DeskSignal>;
  plots: Plots;
  otherNs: number | null;
}

/** The plots, one below the other, over one time axis. */
export function PlotStack({ doc, signals, plots, otherNs }: Props) {
  const t = useTexts();
  const store = useStore();
  const looking = useLooking();
  const transport = useReplay()?.transport;
  const rows = useRef<HTMLDivElement>(null);
  const whole = useMemo(() => ({ fromNs: doc.from_ns, toNs: doc.to_ns }), [doc.from_ns, doc.to_ns]);
  const view = useWindow() ?? whole;
  const shown = useMemo(
    () => plots.list.map((plot) => plot.signals.flatMap((name) => signals.get(name) ?? [])),
    [plots.list, signals],
  );
  const drawn = useMemo(() => shown.flat(), [shown]);
  const room = useRoom(rows, Math.max(1, ...shown.map((own) => unitsOf(own).length)));
  const area = areaPx(room);
  const tracks = useTracks(doc.id, drawn, view, whole, area);
  const { from_ns, to_ns } = doc;
  const gaps = useQuery(timelineQuery(doc.id, { from_ns, to_ns }, BUCKETS)).data?.gaps ?? NOTHING;
  const trips = useQuery(tripsQuery(doc.id)).data?.trips ?? NOTHING;
  const [selection] = useState(() => new Selection());
  const show = useCallback((next: Stretch) => looking.setWindow(windowOf(next, whole)), [looking, whole]);
  useGestures(rows, {
    whole,
    area,
    view: () => looking.window ?? whole,
    cursor: () => store.cursor?.t_ns ?? whole.fromNs,
    onSeek: (tNs) => transport?.seek(tNs),
    onView: show,
    onHover: (tNs) => looking.setHover(tNs),
    onSelecting: (stretch) => selection.set(stretch),
    onSelected: (stretch, as) => {
      if (as === Selecting.Zoom) show(stretch);
      else transport?.setLoop({ from_ns: stretch.fromNs, to_ns: stretch.toNs });
    },
  });
  const onKeyDown = (event: KeyboardEvent) => {
    const atNs = store.cursor?.t_ns ?? whole.fromNs;
    const actions: Record<string, () => void> = {
      "+": () => show(zoomed(looking.window ?? whole, whole, ZOOM_KEY, atNs)),
      "-": () => show(zoomed(looking.window ?? whole, whole, 1 / ZOOM_KEY, atNs)),
      "0": () => looking.setWindow(null),
    };
    const action = event.target === event.currentTarget ? actions[event.key] : undefined;
    if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    action();
  };
  const { over, handlers } = useDrop((signal) => plots.add(signal, null));
  const devices = useMemo(() => [...new Set(drawn.map(({ line }) => line.device))], [drawn]);
  const ticks = ticksOf(view, area, TICK_PX);
  return (
    <>
      {devices.map((slug) => (
        <Watched key={slug} slug={slug} />
      ))}
      <div
        className={classes.stack}
        style={{ "--desk-legend": `${LEGEND_PX}px` } as React.CSSProperties}
        role="group"
        tabIndex={0}
        aria-label={t("desk.plots")}
        onKeyDown={onKeyDown}
        data-testid="plots"
      >
        <div ref={rows} className={classes.rows}>
          {plots.list.map((plot, at) => (
            <PlotRow
              key={`${at} ${plot.signals[0] ?? ""}`}
              at={at}
              plot={plot}
              signals={shown[at] ?? NOTHING}
              tracks={tracks}
              whole={whole}
              room={room}
              plots={plots}
            />
          ))}
          <div className={classes.newPlot} data-drop={over} data-testid="new-plot" {...handlers}>
            {t("desk.drop_new")}
          </div>
          <Marks
            whole={whole}
            room={room}
            gaps={gaps}
            trips={trips}
            selection={selection}
            otherNs={otherNs}
          />
        </div>
      </div>
      <div className={`${classes.times} bench`} aria-hidden>
        {ticks.at.map((tNs) => (
          <span key={tNs} style={{ left: LEFT_PX + placeOf(tNs, view, area) }}>
            {tickText(tNs, ticks.stepS)}
          </span>
        ))}
        <TimeAtPointer whole={whole} room={room} />
      </div>
    </>
  );
}

/** Keeps the values of a device coming. */
function Watched({ slug }: { slug: string }) {
  useWatchDevice(slug);
  return null;
}

function useRoom(rows: React.RefObject<HTMLElement | null>, axes: number): Room {
  const [width, setWidth] = useState(0);
  useEffect(() => {
    const { current } = rows;
    if (!current) return;
    const observer = new ResizeObserver(() => setWidth(Math.max(0, current.clientWidth - LEGEND_PX)));
    observer.observe(current);
    return () => observer.disconnect();
  }, [rows]);
  return useMemo(() => ({ width, axes }), [width, axes]);
}
