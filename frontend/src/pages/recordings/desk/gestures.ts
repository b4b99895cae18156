/** What pointer and wheel do on the plots. Click: seek. Drag: pan; with Ctrl a box to zoom in; with Shift a loop. */
import { type RefObject, useEffect, useEffectEvent, useRef } from "react";
import type { Stretch } from "../../../replay/looking";
import { clamp, lengthOf, panned, timeAt, zoomed } from "../../../replay/timelineView";
import { LEFT_PX } from "./place";

const ZOOM_A_PX = 0.0025;
/** Moved by less a press was a click. */
const CLICK_PX = 4;

export enum Selecting {
  Zoom = "zoom",
  Loop = "loop",
}

/** The stretch that is being selected. */
export class Selection {
  stretch: Stretch | null = null;
  private readonly listeners = new Set<() => void>();

  subscribe(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => void this.listeners.delete(listener);
  }

  set(stretch: Stretch | null): void {
    this.stretch = stretch;
    for (const listener of [...this.listeners]) listener();
  }
}

interface Gestures {
  whole: Stretch;
  /** Width of the area of the plots, px. */
  area: number;
  view: () => Stretch;
  /** Where the cursor stands, ns. */
  cursor: () => number;
  onSeek: (tNs: number) => void;
  onView: (view: Stretch) => void;
  onHover: (tNs: number | null) => void;
  onSelecting: (stretch: Stretch | null) => void;
  onSelected: (stretch: Stretch, as: Selecting) => void;
}

interface Press {
  x: number;
  tNs: number;
  view: Stretch;
  as: Selecting | null;
  moved: boolean;
}

const PLOT = "[data-plot]";

export function useGestures(rows: RefObject<HTMLElement | null>, gestures: Gestures): void {
  const press = useRef<Press | null>(null);
  const before = useRef<number | null>(null);
  const within = (event: MouseEvent) =>
    event.target instanceof Element && event.target.closest(PLOT) !== null;
  const xOf = (event: MouseEvent) =>
    event.clientX - (rows.current?.getBoundingClientRect().left ?? 0) - LEFT_PX;
  const timeOf = (x: number) => clamp(timeAt(x, gestures.view(), gestures.area), gestures.whole);

  const down = useEffectEvent((event: PointerEvent) => {
    if (event.button !== 0 || !within(event)) return;
    const x = xOf(event);
    const as = event.shiftKey ? Selecting.Loop : event.ctrlKey || event.metaKey ? Selecting.Zoom : null;
    press.current = { x, tNs: timeOf(x), view: gestures.view(), as, moved: false };
    (event.target as Element).setPointerCapture(event.pointerId);
  });
  const move = useEffectEvent((event: PointerEvent) => {
    const x = xOf(event);
    const { current } = press;
    if (!current) {
      gestures.onHover(within(event) && x >= 0 && x <= gestures.area ? timeOf(x) : null);
      return;
    }
    current.moved ||= Math.abs(x - current.x) >= CLICK_PX;
    if (!current.moved) return;
    if (current.as) gestures.onSelecting(between(current.tNs, timeOf(x)));
    else {
      const byNs = ((current.x - x) / gestures.area) * lengthOf(current.view);
      gestures.onView(panned(current.view, gestures.whole, byNs));
    }
  });
  const up = useEffectEvent((event: PointerEvent) => {
    const { current } = press;
    press.current = null;
    if (!current) return;
    gestures.onSelecting(null);
    if (event.type === "pointercancel") return;
    if (current.moved && current.as)
      gestures.onSelected(between(current.tNs, timeOf(xOf(event))), current.as);
    else if (!current.moved) {
      // A second click makes it a double one, which is about the view alone.
      if (event.detail <= 1) before.current = gestures.cursor();
      gestures.onSeek(current.tNs);
    }
  });
  const twice = useEffectEvent((event: MouseEvent) => {
    if (!within(event)) return;
    if (before.current !== null) gestures.onSeek(before.current);
    gestures.onView(gestures.whole);
  });
  const wheel = useEffectEvent((event: WheelEvent) => {
    if (!within(event)) return;
    event.preventDefault();
    const view = gestures.view();
    const sideways = event.shiftKey ? event.deltaY : event.deltaX;
    if (event.shiftKey || Math.abs(sideways) > Math.abs(event.deltaY))
      gestures.onView(panned(view, gestures.whole, (sideways / gestures.area) * lengthOf(view)));
    else
      gestures.onView(zoomed(view, gestures.whole, Math.exp(event.deltaY * ZOOM_A_PX), timeOf(xOf(event))));
  });
  const leave = useEffectEvent(() => {
    if (!press.current) gestures.onHover(null);
  });

  useEffect(() => {
    const { current } = rows;
    if (!current) return;
    const ending = new AbortController();
    const { signal } = ending;
    current.addEventListener("pointerdown", (event) => down(event), { signal });
    current.addEventListener("pointermove", (event) => move(event), { signal });
    current.addEventListener("pointerup", (event) => up(event), { signal });
    current.addEventListener("pointercancel", (event) => up(event), { signal });
    current.addEventListener("pointerleave", () => leave(), { signal });
    current.addEventListener("dblclick", (event) => twice(event), { signal });
    current.addEventListener("wheel", (event) => wheel(event), { signal, passive: false });
    return () => ending.abort();
  }, [rows]);
}

const between = (a: number, b: number): Stretch => ({ fromNs: Math.min(a, b), toNs: Math.max(a, b) });
