import {
  Fragment,
  type KeyboardEvent,
  type PointerEvent,
  useCallback,
  useEffect,
  useMemo,
  useRef,
  useState,
} from "react";
import type UPlot from "uplot";
import type { KeptMark } from "../../../api/scope";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { PlotHead } from "./PlotHead";
import classes from "./Scope.module.css";
import { LEFT_PX, RIGHT_PX, ScopePlot } from "./ScopePlot";
import { parseScales, scalesText, withScale } from "./scales";
import { BITS, limitsOf, type PlotGroup, secondsText } from "./traces";
import { moved, type Pair, within, zoomed } from "./view";

const ZOOM_KEY = 0.5;
const MOVE_KEY = 0.2;
const NEAR_PX = 7;
const CLICK_PX = 4;
const WHEEL = 0.0022;
const MIDDLE = 1;

interface Props {
  groups: readonly PlotGroup[];
  whole: Pair;
  view: Pair;
  endS: number;
  marks: readonly { atS: number; what: KeptMark["what"] }[];
  cursors: Pair | null;
  /** False: what comes in just now; it rolls by itself. */
  still: boolean;
  hoverS: number | null;
  onHover: (atS: number | null) => void;
  onView: (view: Pair | null) => void;
  onCursors: (cursors: Pair) => void;
  /** Knows the plots that are drawn, by the key of their group. */
  drawn: Map<string, UPlot>;
}

/** The plots below each other over one axis of time: drag zooms in, a cursor is moved by dragging it. */
export function ScopePlots(props: Props) {
  const { groups, whole, view, endS, marks, cursors, still, hoverS, drawn } = props;
  const t = useTexts();
  const [search, update] = usePageSearch();
  const scales = useMemo(() => parseScales(search.yscale), [search.yscale]);
  const stack = useRef<HTMLDivElement>(null);
  const width = useWidth(stack);
  const area = Math.max(1, width - LEFT_PX - RIGHT_PX);
  const [box, setBox] = useState<Pair | null>(null);
  const [held, setHeld] = useState<Pair | null>(null);
  const press = useRef<{ fromS: number; cursor: 0 | 1 | null; x: number; pan: Pair | null } | null>(null);
  const shown = held ?? cursors;
  const alone = new Set(groups.flatMap(({ traces }) => traces.map((one) => one.device))).size <= 1;
  const pxOf = (atS: number) => LEFT_PX + ((atS - view[0]) / (view[1] - view[0])) * area;
  const timeOf = (event: { clientX: number }) => {
    const left = stack.current?.getBoundingClientRect().left ?? 0;
    const share = (event.clientX - left - LEFT_PX) / area;
    return view[0] + Math.min(1, Math.max(0, share)) * (view[1] - view[0]);
  };
  const onMade = useCallback(
    (key: string, made: UPlot | null) => {
      if (made) drawn.set(key, made);
      else drawn.delete(key);
    },
    [drawn],
  );
  const onDown = (event: PointerEvent) => {
    if (!still || event.button > 1) return;
    const pans = event.shiftKey || event.button === MIDDLE;
    if (pans) event.preventDefault();
    const x = event.clientX - (stack.current?.getBoundingClientRect().left ?? 0);
    const near = shown?.findIndex((one) => Math.abs(pxOf(one) - x) <= NEAR_PX) ?? -1;
    press.current = {
      fromS: timeOf(event),
      cursor: near === 0 || near === 1 ? near : null,
      x: event.clientX,
      pan: pans ? view : null,
    };
    stack.current?.setPointerCapture(event.pointerId);
  };
  const onMove = (event: PointerEvent) => {
    const { current } = press;
    const atS = timeOf(event);
    props.onHover(atS);
    if (!current) return;
    if (current.pan) {
      const share = (current.x - event.clientX) / area;
      props.onView(moved(current.pan, whole, share) ?? null);
    } else if (current.cursor !== null && shown)
      setHeld(current.cursor === 0 ? [atS, shown[1]] : [shown[0], atS]);
    else if (Math.abs(event.clientX - current.x) >= CLICK_PX)
      setBox([Math.min(current.fromS, atS), Math.max(current.fromS, atS)]);
  };
  const onUp = () => {
    if (held) props.onCursors(held);
    if (box) props.onView(within(box, whole));
    press.current = null;
    setHeld(null);
    setBox(null);
  };
  const onKeyDown = (event: KeyboardEvent) => {
    const atS = hoverS ?? (view[0] + view[1]) / 2;
    const actions: Record<string, () => void> = {
      "+": () => props.onView(zoomed(view, whole, ZOOM_KEY, atS)),
      "-": () => props.onView(zoomed(view, whole, 1 / ZOOM_KEY, atS)),
      "0": () => props.onView(null),
      ArrowLeft: () => props.onView(moved(view, whole, -MOVE_KEY)),
      ArrowRight: () => props.onView(moved(view, whole, MOVE_KEY)),
    };
    const action = actions[event.key];
    if (!still || !action || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    action();
  };
  useWheel(stack, (event) => {
    if (!still || !event.ctrlKey) return;
    event.preventDefault();
    props.onView(zoomed(view, whole, Math.exp(event.deltaY * WHEEL), timeOf(event)));
  });
  return (
    <div
      ref={stack}
      className={classes.stack}
      role="group"
      tabIndex={0}
      aria-label={t("page.scope.plots")}
      onPointerDown={onDown}
      onPointerMove={onMove}
      onPointerUp={onUp}
      onPointerCancel={onUp}
      onPointerLeave={() => props.onHover(null)}
      onDoubleClick={() => still && props.onView(null)}
      onKeyDown={onKeyDown}
      data-testid="scope-plots"
    >
      {groups.map((group, at) => (
        <Fragment key={group.key}>
          <PlotHead
            {...{ group, alone }}
            hoverS={still ? hoverS : (hoverS ?? 0)}
            cursors={shown}
            scale={scales.get(group.key) ?? null}
            shown={() => limitsOf(group, view[0], view[1])}
            onScale={(pair) => update({ yscale: scalesText(withScale(scales, group.key, pair)) })}
          />
          <ScopePlot
            group={group}
            view={view}
            scale={scales.get(group.key) ?? null}
            endS={endS}
            width={width}
            marks={marks}
            onMade={onMade}
            last={at === groups.length - 1}
            label={t("page.scope.plot", {
              signals:
                group.key === BITS
                  ? t("page.scope.plot_bits")
                  : group.traces.map((one) => one.label).join(", "),
            })}
          />
        </Fragment>
      ))}
      <div className={classes.over} aria-hidden>
        {box && (
          <span className={classes.box} style={{ left: pxOf(box[0]), width: pxOf(box[1]) - pxOf(box[0]) }} />
        )}
        {still && 0 >= view[0] && 0 <= view[1] && (
          <span className={classes.flag} style={{ left: pxOf(0) }}>
            <b>{t("page.scope.trigger_flag")}</b>
          </span>
        )}
        {hoverS !== null && <span className={classes.hover} style={{ left: pxOf(hoverS) }} />}
        {shown?.map((atS, at) =>
          atS < view[0] || atS > view[1] ? null : (
            <span key={at} className={classes.cursor} data-cursor={at} style={{ left: pxOf(atS) }}>
              <b>{at === 0 ? "A" : "B"}</b>
            </span>
          ),
        )}
      </div>
      {shown && (
        <p className={`${classes.between} bench`} data-testid="between">
          Δt <strong>{secondsText(shown[1] - shown[0], t)} s</strong>
        </p>
      )}
      <p className={classes.axis}>{t(still ? "page.scope.time_axis" : "page.scope.time_axis_live")}</p>
    </div>
  );
}

export function useWidth(element: React.RefObject<HTMLElement | null>): number {
  const [width, setWidth] = useState(0);
  useEffect(() => {
    const { current } = element;
    if (!current) return;
    const observer = new ResizeObserver(() => setWidth(current.clientWidth));
    observer.observe(current);
    return () => observer.disconnect();
  }, [element]);
  return width;
}

/** React's own wheel listeners cannot keep the page from zooming. */
function useWheel(element: React.RefObject<HTMLElement | null>, act: (event: WheelEvent) => void): void {
  const latest = useRef(act);
  useEffect(() => {
    latest.current = act;
  });
  useEffect(() => {
    const { current } = element;
    if (!current) return;
    const ending = new AbortController();
    const options = { signal: ending.signal, passive: false };
    current.addEventListener("wheel", (event) => latest.current(event), options);
    return () => ending.abort();
  }, [element]);
}
