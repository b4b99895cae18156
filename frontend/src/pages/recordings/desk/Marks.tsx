import { useEffect, useRef } from "react";
import type { TimelineGap, TripDoc } from "../../../api/replay";
import { useStore } from "../../../live/live";
import { type Stretch, useLooking } from "../../../replay/looking";
import { timeOfDay } from "../../../ui/format";
import classes from "./Desk.module.css";
import type { Selection } from "./gestures";
import { areaPx, extent, LEFT_PX, type Room } from "./place";

interface Props {
  whole: Stretch;
  room: Room;
  gaps: readonly TimelineGap[];
  trips: readonly TripDoc[];
  selection: Selection;
  /** The second moment, which parameters are compared with. */
  otherNs: number | null;
}

/** Cursor, moment under the pointer, loop, selection, gaps and trips over all plots; moved past React. */
export function Marks({ whole, room, gaps, trips, selection, otherNs }: Props) {
  const store = useStore();
  const looking = useLooking();
  const layer = useRef<HTMLDivElement>(null);
  const area = areaPx(room);
  useEffect(() => {
    let asked = 0;
    const draw = () => {
      asked = 0;
      const view = looking.window ?? whole;
      const { cursor } = store;
      const { current } = layer;
      if (!current) return;
      const put = (name: string, stretch: Stretch | null, wide: boolean) => {
        const place = stretch && extent(stretch, view, area);
        for (const element of current.querySelectorAll<HTMLElement>(`[data-mark="${name}"]`))
          lay(element, place, wide);
      };
      const moment = (tNs: number | null | undefined): Stretch | null =>
        tNs == null ? null : { fromNs: tNs, toNs: tNs };
      put("cursor", moment(cursor?.t_ns), false);
      put("hover", moment(looking.hoverNs), false);
      put("other", moment(otherNs), false);
      put("loop", cursor?.loop ? { fromNs: cursor.loop.from_ns, toNs: cursor.loop.to_ns } : null, true);
      put("selection", selection.stretch, true);
      for (const element of current.querySelectorAll<HTMLElement>("[data-from]"))
        lay(
          element,
          extent({ fromNs: Number(element.dataset.from), toNs: Number(element.dataset.to) }, view, area),
          element.dataset.from !== element.dataset.to,
        );
    };
    const soon = () => {
      asked ||= requestAnimationFrame(draw);
    };
    draw();
    const ends = [
      store.subscribe("cursor", soon),
      looking.subscribe("hover", soon),
      looking.subscribe("window", soon),
      selection.subscribe(soon),
    ];
    return () => {
      cancelAnimationFrame(asked);
      for (const end of ends) end();
    };
  }, [store, looking, whole, area, selection, gaps, trips, otherNs]);
  return (
    <div ref={layer} className={classes.marks} style={{ left: LEFT_PX, width: area }} aria-hidden>
      {gaps
        .filter((gap) => gap.to_ns > gap.from_ns)
        .map((gap) => (
          <div
            key={`${gap.kind} ${gap.bus} ${gap.from_ns}`}
            className={classes.gap}
            data-from={gap.from_ns}
            data-to={gap.to_ns}
          />
        ))}
      {trips.map((trip) => (
        <div key={trip.number} className={classes.trip} data-from={trip.t0_ns} data-to={trip.t0_ns} />
      ))}
      <div className={classes.loop} data-mark="loop" />
      <div className={classes.selection} data-mark="selection" />
      <div className={classes.other} data-mark="other" />
      <div className={classes.hover} data-mark="hover" data-testid="hover-line" />
      <div className={classes.cursor} data-mark="cursor" data-testid="cursor-line" />
    </div>
  );
}

function lay(element: HTMLElement, place: { left: number; width: number } | null, wide: boolean): void {
  element.style.display = place === null ? "none" : "block";
  if (place === null) return;
  element.style.transform = `translateX(${place.left.toFixed(2)}px)`;
  if (wide) element.style.width = `${Math.max(1, place.width).toFixed(2)}px`;
}

/** The moment under the pointer in words, on the time axis. */
export function TimeAtPointer({ whole, room }: { whole: Stretch; room: Room }) {
  const looking = useLooking();
  const place = useRef<HTMLSpanElement>(null);
  useEffect(() => {
    const show = () => {
      const { current } = place;
      if (!current) return;
      const { hoverNs } = looking;
      const area = areaPx(room);
      const at =
        hoverNs === null ? null : extent({ fromNs: hoverNs, toNs: hoverNs }, looking.window ?? whole, area);
      current.style.display = at === null ? "none" : "inline";
      if (at === null || hoverNs === null) return;
      current.style.left = `${LEFT_PX + Math.min(Math.max(at.left, 30), area - 30)}px`;
      current.textContent = timeOfDay(hoverNs / 1e6);
    };
    show();
    return looking.subscribe("hover", show);
  }, [looking, whole, room]);
  return <span ref={place} className={classes.at} data-testid="time-at-pointer" />;
}
