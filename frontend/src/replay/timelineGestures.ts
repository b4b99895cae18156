/** What pointer and wheel do on the timeline: seek, select a stretch, pan, zoom, by one finger or two. */
import { type RefObject, useEffect, useEffectEvent } from "react";
import type { Stretch } from "./looking";
import { RULER_PX, STRIP_PX } from "./timelinePaint";
import { clamp, lengthOf, panned, timeAt, zoomed } from "./timelineView";

const ZOOM_A_PX = 0.0025;
/** Shorter than this a selection was a click. */
const LEAST_SELECTION_PX = 4;
const LEAST_SPREAD_PX = 8;
const ALL = 0.999;

export interface Gestures {
  view: Stretch;
  whole: Stretch;
  /** Dragging selects instead of seeking. */
  selects: boolean;
  onSeek: (tNs: number) => void;
  onView: (view: Stretch) => void;
  onSelecting: (stretch: Stretch | null) => void;
  onSelected: (stretch: Stretch) => void;
  onHover: (tNs: number | null) => void;
}

enum Drag {
  Seek = "seek",
  Select = "select",
  Pan = "pan",
  Window = "window",
}

interface Held {
  drag: Drag;
  startX: number;
  startNs: number;
  view: Stretch;
}

export function useGestures(element: RefObject<HTMLElement | null>, gestures: Gestures): void {
  const now = useEffectEvent(() => gestures);
  useEffect(() => {
    if (element.current) return listen(element.current, () => now());
  }, [element]);
}

function listen(element: HTMLElement, now: () => Gestures): () => void {
  const hand = new Hand(element, now);
  const ending = new AbortController();
  const { signal } = ending;
  element.addEventListener("pointerdown", hand.down, { signal });
  element.addEventListener("pointermove", hand.move, { signal });
  element.addEventListener("pointerup", hand.up, { signal });
  element.addEventListener("pointercancel", hand.up, { signal });
  element.addEventListener("pointerleave", () => now().onHover(null), { signal });
  element.addEventListener("wheel", hand.wheel, { signal, passive: false });
  return () => ending.abort();
}

class Hand {
  private readonly element: HTMLElement;
  private readonly now: () => Gestures;
  private readonly fingers = new Map<number, number>();
  private held: Held | null = null;

  constructor(element: HTMLElement, now: () => Gestures) {
    this.element = element;
    this.now = now;
  }

  readonly down = (event: PointerEvent): void => {
    const { x, width } = this.place(event);
    this.fingers.set(event.pointerId, x);
    this.element.setPointerCapture(event.pointerId);
    const { view, whole, onSeek } = this.now();
    const drag = event.button === 1 ? Drag.Pan : this.dragOf(event);
    const startNs = timeAt(x, view, width);
    this.held = { drag, startX: x, startNs, view };
    if (drag === Drag.Seek) onSeek(clamp(startNs, whole));
    if (drag === Drag.Window) this.centre(x, width);
  };

  readonly move = (event: PointerEvent): void => {
    const { x, y, width } = this.place(event);
    const { view, whole, onHover, onSeek, onSelecting, onView } = this.now();
    if (this.fingers.size > 1 && this.fingers.has(event.pointerId)) {
      this.held = null;
      this.pinch(event.pointerId, x, width);
      return;
    }
    const atNs = clamp(timeAt(x, view, width), whole);
    onHover(y < STRIP_PX ? clamp(timeAt(x, whole, width), whole) : atNs);
    const { held } = this;
    this.element.dataset.drag = held?.drag ?? this.dragOf(event);
    if (held?.drag === Drag.Seek) onSeek(atNs);
    else if (held?.drag === Drag.Select) onSelecting(between(clamp(held.startNs, whole), atNs));
    else if (held?.drag === Drag.Window) this.centre(x, width);
    else if (held) onView(panned(held.view, whole, held.startNs - timeAt(x, held.view, width)));
  };

  readonly up = (event: PointerEvent): void => {
    this.fingers.delete(event.pointerId);
    const { held } = this;
    this.held = null;
    if (held?.drag !== Drag.Select) return;
    const { view, whole, onSelecting, onSelected } = this.now();
    onSelecting(null);
    const { x, width } = this.place(event);
    if (event.type !== "pointerup" || Math.abs(x - held.startX) < LEAST_SELECTION_PX) return;
    onSelected(between(clamp(held.startNs, whole), clamp(timeAt(x, view, width), whole)));
  };

  readonly wheel = (event: WheelEvent): void => {
    event.preventDefault();
    const { x, width } = this.place(event);
    const { view, whole, onView } = this.now();
    const sideways = event.shiftKey ? event.deltaX || event.deltaY : event.deltaX;
    if (event.shiftKey || Math.abs(sideways) > Math.abs(event.deltaY))
      onView(panned(view, whole, (sideways / width) * lengthOf(view)));
    else onView(zoomed(view, whole, Math.exp(event.deltaY * ZOOM_A_PX), timeAt(x, view, width)));
  };

  /** The part of the timeline that is touched: strip of the whole, lane, ruler. */
  private dragOf(event: PointerEvent): Drag {
    const { y, height } = this.place(event);
    if (y < STRIP_PX + 2) return Drag.Window;
    if (y > height - RULER_PX) return Drag.Pan;
    return this.now().selects || event.shiftKey ? Drag.Select : Drag.Seek;
  }

  private place({ clientX, clientY }: MouseEvent): { x: number; y: number; width: number; height: number } {
    const { left, top, width, height } = this.element.getBoundingClientRect();
    return { x: clientX - left, y: clientY - top, width, height };
  }

  /** In the strip of the whole: brings the place into view; where all is in view already the cursor goes there. */
  private centre(x: number, width: number): void {
    const { view, whole, onSeek, onView } = this.now();
    const atNs = timeAt(x, whole, width);
    if (lengthOf(view) >= lengthOf(whole) * ALL) onSeek(clamp(atNs, whole));
    else onView(panned(view, whole, atNs - (view.fromNs + view.toNs) / 2));
  }

  private pinch(id: number, x: number, width: number): void {
    const { view, whole, onView } = this.now();
    const before = [...this.fingers.values()];
    this.fingers.set(id, x);
    const after = [...this.fingers.values()];
    const factor = spreadOf(before) / spreadOf(after);
    const wider = zoomed(view, whole, factor, timeAt(middleOf(before), view, width));
    onView(panned(wider, whole, ((middleOf(before) - middleOf(after)) / width) * lengthOf(wider)));
  }
}

const spreadOf = ([a = 0, b = 0]: number[]): number => Math.max(LEAST_SPREAD_PX, Math.abs(a - b));
const middleOf = ([a = 0, b = 0]: number[]): number => (a + b) / 2;
const between = (a: number, b: number): Stretch => ({ fromNs: Math.min(a, b), toNs: Math.max(a, b) });
