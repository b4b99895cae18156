import { useComputedColorScheme } from "@mantine/core";
import { useDebouncedValue } from "@mantine/hooks";
import { useQuery } from "@tanstack/react-query";
import { type KeyboardEvent, type RefObject, useCallback, useEffect, useMemo, useRef, useState } from "react";
import { indexQuery, type ReplayDoc, type Timeline as Content, timelineQuery } from "../api/replay";
import { useCursor, useStore } from "../live/live";
import { useTexts } from "../texts/texts";
import { timeOfDay } from "../ui/format";
import { dateText, tickText } from "./clockText";
import { type Stretch, useLooking, useWindow } from "./looking";
import { type Marked, useMarked } from "./marked";
import classes from "./Replay.module.css";
import { TimelineHover } from "./TimelineHover";
import { useGestures } from "./timelineGestures";
import { coloursOf, paintGround, paintMoving, type Picture } from "./timelinePaint";
import { following, lengthOf, ticksOf, windowOf, zoomed } from "./timelineView";
import type { Transport } from "./transport";

const TICK_PX = 96;
const ZOOM_SETTLES_MS = 150;
const BUCKETS = 400;
const ZOOM_KEY = 0.5;
const STEP_S = 1;
const PAGE_S = 10;

interface Props {
  doc: ReplayDoc;
  transport: Transport;
  /** Dragging selects a stretch to be looped. */
  selects: boolean;
  onSelected: (stretch: Stretch) => void;
}

/** The whole recording at a look, and the stretch in view: load, gaps, events, loop and cursor. */
export function Timeline({ doc, transport, selects, onSelected }: Props) {
  const t = useTexts();
  const store = useStore();
  const looking = useLooking();
  const whole = useMemo(() => ({ fromNs: doc.from_ns, toNs: doc.to_ns }), [doc.from_ns, doc.to_ns]);
  const view = useWindow() ?? whole;
  const { far, near, index } = useContent(doc, whole, view);
  const marked = useMarked(doc.recording);
  const holder = useRef<HTMLDivElement>(null);
  const selecting = useRef<Stretch | null>(null);
  const redraw = useLayers(holder, { view, whole, far, near, marked }, selecting);
  const show = useCallback((next: Stretch) => looking.setWindow(windowOf(next, whole)), [looking, whole]);
  useGestures(holder, {
    view,
    whole,
    selects,
    onSeek: transport.seek,
    onView: show,
    onSelecting: (stretch) => {
      selecting.current = stretch;
      redraw();
    },
    onSelected: (stretch) => {
      transport.setLoop({ from_ns: stretch.fromNs, to_ns: stretch.toNs });
      onSelected(stretch);
    },
    onHover: (tNs) => looking.setHover(tNs),
  });
  // A cursor that plays takes the view along.
  useEffect(
    () =>
      store.subscribe("cursor", () => {
        const { cursor } = store;
        if (cursor && looking.window && looking.follow) show(following(looking.window, whole, cursor.t_ns));
      }),
    [store, looking, show, whole],
  );
  const onKeyDown = (event: KeyboardEvent) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const atNs = store.cursor?.t_ns ?? whole.fromNs;
    const actions: Record<string, () => void> = {
      ArrowLeft: () => transport.stepTime(-STEP_S),
      ArrowRight: () => transport.stepTime(STEP_S),
      ArrowDown: () => transport.stepTime(-STEP_S),
      ArrowUp: () => transport.stepTime(STEP_S),
      PageDown: () => transport.stepTime(-PAGE_S),
      PageUp: () => transport.stepTime(PAGE_S),
      Home: () => transport.seek(whole.fromNs),
      End: () => transport.seek(whole.toNs),
      "+": () => show(zoomed(looking.window ?? whole, whole, ZOOM_KEY, atNs)),
      "-": () => show(zoomed(looking.window ?? whole, whole, 1 / ZOOM_KEY, atNs)),
      "0": () => looking.setWindow(null),
    };
    const action = actions[event.key];
    if (!action) return;
    event.preventDefault();
    event.stopPropagation();
    action();
  };
  return (
    <div className={classes.timeline}>
      <div
        ref={holder}
        className={classes.lanes}
        role="slider"
        tabIndex={0}
        aria-label={t("page.replay.timeline")}
        aria-valuemin={0}
        aria-valuemax={lengthOf(whole) / 1e9}
        {...useSliderValue(whole)}
        onKeyDown={onKeyDown}
        data-testid="timeline"
        data-ready={far !== null}
        data-marked={marked.length}
        data-selects={selects}
      >
        <canvas aria-hidden />
        <canvas aria-hidden />
      </div>
      <TimelineHover content={near ?? far} marked={marked} view={view} />
      {far === null && (
        <span className={classes.indexing} role="status" data-testid="indexing">
          {index?.state === "failed"
            ? t("page.replay.index_failed", { reason: index.reason })
            : t("page.replay.indexing", { percent: Math.round((index?.progress ?? 0) * 100) })}
        </span>
      )}
    </div>
  );
}

/** What a screen reader hears; while it plays no oftener than once a second. */
function useSliderValue(whole: Stretch) {
  const cursor = useCursor();
  const tNs = cursor?.t_ns ?? whole.fromNs;
  const seconds = (tNs - whole.fromNs) / 1e9;
  const shown = cursor?.playing === true ? Math.floor(seconds) : seconds;
  const ms = (whole.fromNs + shown * 1e9) / 1e6;
  return { "aria-valuenow": shown, "aria-valuetext": `${dateText(ms)} ${timeOfDay(ms)}` };
}

function useContent(doc: ReplayDoc, whole: Stretch, view: Stretch) {
  const index = useQuery(indexQuery(doc.id)).data;
  const ready = index?.state === "ready";
  const [settled] = useDebouncedValue(view, ZOOM_SETTLES_MS);
  const loop = ({ fromNs, toNs }: Stretch) => ({ from_ns: fromNs, to_ns: toNs });
  const far = useQuery(timelineQuery(doc.id, loop(whole), BUCKETS, ready)).data ?? null;
  const zoomedIn = windowOf(settled, whole) !== null;
  const near = useQuery(timelineQuery(doc.id, loop(settled), BUCKETS, ready && zoomedIn)).data ?? null;
  return { index, far, near: windowOf(view, whole) === null ? null : near };
}

interface Layers {
  view: Stretch;
  whole: Stretch;
  far: Content | null;
  near: Content | null;
  marked: readonly Marked[];
}

/** Draws both layers: the ground where something of it changed, what moves with every picture that the screen shows. */
function useLayers(
  holder: RefObject<HTMLDivElement | null>,
  { view, whole, far, near, marked }: Layers,
  selecting: RefObject<Stretch | null>,
): () => void {
  const store = useStore();
  const looking = useLooking();
  const scheme = useComputedColorScheme();
  const [width, setWidth] = useState(0);
  const moving = useRef<() => void>(() => undefined);
  useEffect(() => {
    const element = holder.current;
    if (!element) return;
    const observer = new ResizeObserver(() => setWidth(element.clientWidth));
    observer.observe(element);
    return () => observer.disconnect();
  }, [holder]);
  useEffect(() => {
    const element = holder.current;
    if (!element || width === 0) return;
    const [ground, above] = [...element.querySelectorAll("canvas")].map((one) => brushOf(one, element));
    if (!ground || !above) return;
    const colours = coloursOf(element);
    const height = element.clientHeight;
    const picture: Picture = {
      width,
      height,
      view,
      whole,
      near,
      far,
      marked,
      ticks: ticksOf(view, width, TICK_PX),
      label: tickText,
      colours,
    };
    paintGround(ground, picture);
    let asked = 0;
    const draw = () => {
      asked = 0;
      const { cursor } = store;
      paintMoving(above, picture, {
        cursorNs: cursor?.t_ns ?? whole.fromNs,
        loop: cursor?.loop ?? null,
        selecting: selecting.current,
        hoverNs: looking.hoverNs,
      });
    };
    const soon = () => {
      asked ||= requestAnimationFrame(draw);
    };
    moving.current = soon;
    draw();
    const ends = [store.subscribe("cursor", soon), looking.subscribe("hover", soon)];
    return () => {
      cancelAnimationFrame(asked);
      for (const end of ends) end();
    };
  }, [holder, selecting, store, looking, scheme, width, view, whole, near, far, marked]);
  return useCallback(() => moving.current(), []);
}

function brushOf(canvas: HTMLCanvasElement, element: HTMLElement): CanvasRenderingContext2D | null {
  const dense = devicePixelRatio;
  canvas.width = Math.round(element.clientWidth * dense);
  canvas.height = Math.round(element.clientHeight * dense);
  const brush = canvas.getContext("2d");
  brush?.setTransform(dense, 0, 0, dense, 0, 0);
  return brush;
}
