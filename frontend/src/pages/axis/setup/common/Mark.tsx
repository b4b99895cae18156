import { type KeyboardEvent, type PointerEvent, useRef } from "react";
import { useTexts } from "../../../../texts/texts";
import { type Bounds, type Edge, held, isShut, keyed } from "./bounds";
import { type Parameter, scaled, setRaw, textOf } from "./parameter";
import { type Scale, shareOf, valueAt } from "./scale";
import classes from "./Setup.module.css";

export interface MarkProps {
  parameter: Parameter;
  /** What it is, in full, for who cannot see where it stands. */
  name: string;
  /** What stands beside it. */
  label: string;
  scale: Scale;
  bounds: Bounds;
  /** Steps of the pointer and of the page keys, in the unit of the scale. */
  snap: number;
  page: number;
  tone: "plain" | "cold" | "warm" | "warning" | "error";
  /** The row of the lane in which its handle stands, so that neighbours do not cover each other. */
  row?: 0 | 1;
  onStopped: (by: Edge | null) => void;
}

const END = 0.72;

/** A threshold on its scale: moved by pointer or keys up to its neighbours; while it is pending, a ghost stands at the old value. */
export function Mark({
  parameter,
  name,
  label,
  scale,
  bounds,
  snap,
  page,
  tone,
  row = 0,
  onStopped,
}: MarkProps) {
  const t = useTexts();
  const grabbed = useRef<{ offset: number; raw: number } | null>(null);
  const { raw, ram, change, lock } = parameter;
  if (raw === null) return null;
  const factor = scaled(parameter, 1);
  const move = (wanted: number) => {
    const to = isShut(bounds) ? { raw, by: bounds.low } : held(wanted, bounds);
    setRaw(parameter, to.raw);
    onStopped(to.by);
  };
  const shareAt = (event: PointerEvent<HTMLElement>) => {
    const box = event.currentTarget.parentElement?.getBoundingClientRect();
    return box ? (event.clientX - box.left) / box.width : 0;
  };
  const share = shareOf(scale, scaled(parameter, raw));
  const onPointerDown = (event: PointerEvent<HTMLElement>) => {
    if (event.button !== 0 || lock !== null) return;
    event.currentTarget.setPointerCapture(event.pointerId);
    grabbed.current = { offset: shareAt(event) - share, raw };
    onStopped(null);
  };
  const onPointerMove = (event: PointerEvent<HTMLElement>) => {
    if (grabbed.current === null) return;
    move(Math.round(valueAt(scale, shareAt(event) - grabbed.current.offset, snap) / factor));
  };
  const onPointerCancel = () => {
    if (grabbed.current !== null) setRaw(parameter, grabbed.current.raw);
    grabbed.current = null;
  };
  const onKeyDown = (event: KeyboardEvent) => {
    const wanted = keyed(event.key, raw, Math.round(page / factor), bounds);
    if (wanted === null || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    if (lock === null) move(wanted);
  };
  const text = textOf(parameter, raw);
  const spoken = change ? t("page.setup.common.pending", { value: text, was: textOf(parameter, ram) }) : text;
  return (
    <>
      {change && ram !== null && (
        <span
          className={classes.ghost}
          data-row={row}
          style={{ left: `${100 * shareOf(scale, scaled(parameter, ram))}%` }}
          title={t("page.setup.common.was", { value: textOf(parameter, ram) })}
          aria-hidden
        />
      )}
      <span
        role="slider"
        tabIndex={0}
        className={classes.mark}
        data-tone={tone}
        data-row={row}
        data-side={share > END ? "left" : "right"}
        data-pending={change !== undefined}
        data-locked={lock !== null}
        style={{ left: `${100 * share}%` }}
        aria-label={name}
        aria-valuenow={scaled(parameter, raw)}
        aria-valuemin={bounds.low === null ? scale.low : scaled(parameter, bounds.low.raw)}
        aria-valuemax={bounds.high === null ? scale.high : scaled(parameter, bounds.high.raw)}
        aria-valuetext={spoken}
        aria-disabled={lock !== null}
        title={lock === null ? name : t(`page.locked.${lock}`)}
        onPointerDown={onPointerDown}
        onPointerMove={onPointerMove}
        onPointerUp={() => (grabbed.current = null)}
        onPointerCancel={onPointerCancel}
        onKeyDown={onKeyDown}
        onBlur={() => onStopped(null)}
        data-testid={`mark-${parameter.entry.address}`}
      >
        <span className={classes.knob} aria-hidden />
        <span className={classes.flag} aria-hidden>
          {label} <b>{text}</b>
          {change && " ✎"}
        </span>
      </span>
    </>
  );
}
