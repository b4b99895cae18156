import { type ReactNode, useEffect, useMemo, useRef } from "react";
import { useCell } from "../../../live/live";
import { shownOf } from "../../../model/shown";
import { type Track, spanAt } from "../../../model/tracks";
import { useLooking, type Stretch } from "../../../replay/looking";
import { useTexts } from "../../../texts/texts";
import { rawOf } from "../../parameters/cellValue";
import classes from "./Desk.module.css";
import { type Look, looksOf } from "./looks";
import { secondsOf } from "./place";
import { type DeskSignal, textOfSpan } from "./signals";

interface Props {
  signals: readonly DeskSignal[];
  tracks: ReadonlyMap<string, Track>;
  whole: Stretch;
  /** Of the plot, beside the first object. */
  menu: ReactNode;
}

/** What is drawn, object by object: value at the cursor as the decoder says, and beside it at the pointer. */
export function Lines({ signals, tracks, whole, menu }: Props) {
  const looks = useMemo(() => looksOf(signals), [signals]);
  const objects = useMemo(() => byObject(signals), [signals]);
  return objects.map(([title, own], at) => (
    <div key={title}>
      <div
        className={at === 0 ? classes.head : classes.object}
        title={`${title} (${own[0]?.line.address ?? ""})`}
      >
        <span>{title}</span>
        <span>{own[0]?.unit}</span>
        {at === 0 && menu}
      </div>
      {own.map((signal) => (
        <Line
          key={signal.name}
          signal={signal}
          look={looks.get(signal.name)}
          track={tracks.get(signal.name)}
          whole={whole}
        />
      ))}
    </div>
  ));
}

function byObject(signals: readonly DeskSignal[]): [string, DeskSignal[]][] {
  const found = new Map<string, DeskSignal[]>();
  for (const one of signals) {
    const own = found.get(one.title);
    if (own) own.push(one);
    else found.set(one.title, [one]);
  }
  return [...found];
}

interface LineProps {
  signal: DeskSignal;
  look: Look | undefined;
  track: Track | undefined;
  whole: Stretch;
}

function Line({ signal, look, track, whole }: LineProps) {
  return (
    <div className={classes.line} data-testid={`line-${signal.name}`}>
      <Swatch look={look} />
      <span title={signal.deviceTitle}>{signal.stationTitle}</span>
      <AtCursor signal={signal} />
      <AtPointer signal={signal} track={track} whole={whole} />
    </div>
  );
}

export function Swatch({ look }: { look: Look | undefined }) {
  return (
    <svg className={classes.swatch} viewBox="0 0 18 10" aria-hidden>
      <line
        x1={0}
        x2={18}
        y1={5}
        y2={5}
        stroke={`var(--desk-${look?.colour ?? 0})`}
        strokeWidth={2.5}
        strokeDasharray={look?.dash.join(" ")}
      />
    </svg>
  );
}

/** The value of the live state at the cursor, decoded like all else that the page shows of this moment. */
export function AtCursor({ signal }: { signal: DeskSignal }) {
  const t = useTexts();
  const { device, address } = signal.line;
  const cell = useCell(device, address);
  const raw = rawOf(cell);
  const shown = raw === null ? null : shownOf(signal.entry, raw, signal.context);
  return (
    <span
      className={classes.number}
      data-stale={cell?.stale ?? false}
      data-testid="at-cursor"
      title={
        raw === null
          ? t("desk.unknown")
          : t("desk.raw", { raw, address, text: shown?.names.length ? shown.names.join(", ") : shown?.text })
      }
    >
      {shown?.text.replace("-", "−") ?? "–"}
    </span>
  );
}

/** Written past React: the pointer is faster. */
function AtPointer({ signal, track, whole }: Pick<LineProps, "signal" | "track" | "whole">) {
  const t = useTexts();
  const looking = useLooking();
  const place = useRef<HTMLSpanElement>(null);
  useEffect(() => {
    const show = () => {
      const { hoverNs } = looking;
      const element = place.current;
      if (!element) return;
      const known = hoverNs === null || !track ? null : spanAt(track, secondsOf(hoverNs, whole));
      element.textContent = hoverNs === null ? "" : textOfSpan(signal, known, t);
    };
    show();
    return looking.subscribe("hover", show);
  }, [looking, track, signal, whole, t]);
  return <span ref={place} className={classes.hovered} data-testid="at-pointer" />;
}
