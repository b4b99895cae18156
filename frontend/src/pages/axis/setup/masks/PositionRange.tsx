import { type KeyboardEvent, type PointerEvent, useRef, useState } from "react";
import type { DeviceContext } from "../../../../model/shown";
import { useTexts } from "../../../../texts/texts";
import { ReadingText } from "../../../../ui/ReadingText";
import { useReading } from "../../../../ui/reading";
import { between, type Bounds, type Edge, held, isShut, keyed } from "../common/bounds";
import { Findings, findingsOf } from "../common/Findings";
import { boundsOf, type Parameter, setRaw, type Setup, textOf } from "../common/parameter";
import setupClasses from "../common/Setup.module.css";
import { stopText } from "../common/stopText";
import { TypedValue } from "../common/TypedValue";
import { angleAt, arcPath, pointAt } from "./arc";
import classes from "./Masks.module.css";

const LOWER = "3220:01";
const UPPER = "3220:02";
const MASK = "3220:03";
export const RANGE: readonly string[] = [LOWER, UPPER, MASK];
const POSITION = "6064";
/** The PMM compares hundredths of a degree. */
const PER_DEGREE = 100;
const PAGE_DEG = 5;
const RADIUS = 100;
const TICKS = [-180, -90, 0, 90, 180];

interface Props {
  unit: DeviceContext;
  pmc: DeviceContext | null;
  setup: Setup;
}

/** The range of angles in which outputs are set: two ends on an arc, and where the blade stands. */
export function PositionRange({ unit, pmc, setup }: Props) {
  const t = useTexts();
  const [stopped, setStopped] = useState<{ parameter: Parameter; by: Edge } | null>(null);
  const [lower, upper, mask] = RANGE.map((one) => setup.of(unit, one));
  const reading = useReading(pmc, POSITION, "fast");
  if (!lower || !upper) return null;
  const name = (end: "lower" | "upper") => t(`page.setup.masks.range.${end}`);
  const look = () => null;
  const bounds = {
    lower: boundsOf(lower, between(null, { raw: upper.raw, name: name("upper"), gap: 1 }), look),
    upper: boundsOf(upper, between({ raw: lower.raw, name: name("lower"), gap: 1 }, null), look),
  };
  const position = typeof reading?.raw === "number" ? reading.raw / PER_DEGREE : null;
  const inside =
    position === null || lower.raw === null || upper.raw === null
      ? null
      : position * PER_DEGREE > lower.raw && position * PER_DEGREE < upper.raw;
  const ends = [
    { key: "lower" as const, parameter: lower },
    { key: "upper" as const, parameter: upper },
  ];
  return (
    <section className={classes.panel} aria-labelledby="setup-range">
      <h2 id="setup-range">{t("page.setup.masks.range.title")}</h2>
      <p className="dim">{t("page.setup.masks.range.intro")}</p>
      <div className={classes.range}>
        <svg viewBox="-150 -136 300 166" className={classes.arc} data-testid="range-arc">
          <path d={arcPath(-180, 180, RADIUS)} className={classes.whole} />
          {lower.raw !== null && upper.raw !== null && (
            <path
              d={arcPath(lower.raw / PER_DEGREE, upper.raw / PER_DEGREE, RADIUS)}
              className={classes.within}
            />
          )}
          {TICKS.map((tick) => {
            const { x, y } = pointAt(tick, RADIUS + 28);
            return (
              <text key={tick} x={x} y={y + (tick % 180 === 0 && tick !== 0 ? 14 : 3)} aria-hidden>
                {tick}°
              </text>
            );
          })}
          {position !== null && (
            <line
              x1={0}
              y1={0}
              x2={pointAt(position, RADIUS - 8).x}
              y2={pointAt(position, RADIUS - 8).y}
              className={classes.blade}
              data-stale={reading?.stale}
            />
          )}
          {ends.map(({ key, parameter }) => (
            <End
              key={key}
              parameter={parameter}
              bounds={bounds[key]}
              name={`${t("page.setup.masks.range.title")}: ${name(key)} (${parameter.entry.address})`}
              onStopped={(by) => setStopped(by && { parameter, by })}
            />
          ))}
        </svg>
        <div className={classes.rangeFacts}>
          <div className={classes.rangeNumbers}>
            {ends.map(({ key, parameter }) => (
              <TypedValue
                key={key}
                parameter={parameter}
                name={`${name(key)} (${parameter.entry.address})`}
                label={name(key)}
                bounds={bounds[key]}
              />
            ))}
          </div>
          <p>
            {t("page.setup.masks.range.position")}{" "}
            <ReadingText context={pmc} address={POSITION} pace="fast" />{" "}
            {inside !== null && (
              <strong data-testid="range-inside">
                {t(inside ? "page.setup.masks.range.inside" : "page.setup.masks.range.outside")}
              </strong>
            )}
          </p>
          {mask?.raw === 0 && <p className="dim">{t("page.setup.masks.range.no_output")}</p>}
          <p className={setupClasses.stopped} role="status" data-testid="stopped-3220">
            {stopped && stopText(stopped.parameter, stopped.by, t)}
          </p>
          <Findings findings={findingsOf([lower, upper])} />
        </div>
      </div>
    </section>
  );
}

interface EndProps {
  parameter: Parameter;
  bounds: Bounds;
  name: string;
  onStopped: (by: Edge | null) => void;
}

/** One end of the range, moved along the arc. */
function End({ parameter, bounds, name, onStopped }: EndProps) {
  const t = useTexts();
  const grabbed = useRef<number | null>(null);
  const { raw, ram, change, lock } = parameter;
  if (raw === null) return null;
  const move = (wanted: number) => {
    const to = isShut(bounds) ? { raw, by: bounds.low } : held(wanted, bounds);
    setRaw(parameter, to.raw);
    onStopped(to.by);
  };
  const onPointerMove = (event: PointerEvent<SVGGElement>) => {
    const svg = event.currentTarget.ownerSVGElement;
    const back = svg?.getScreenCTM()?.inverse();
    if (grabbed.current === null || !back) return;
    const { x, y } = new DOMPoint(event.clientX, event.clientY).matrixTransform(back);
    move(Math.round(angleAt({ x, y })) * PER_DEGREE);
  };
  const onKeyDown = (event: KeyboardEvent) => {
    const wanted = keyed(event.key, raw, PAGE_DEG * PER_DEGREE, bounds);
    if (wanted === null || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    if (lock === null) move(wanted);
  };
  const text = textOf(parameter, raw);
  const place = pointAt(raw / PER_DEGREE, RADIUS);
  const ghost = change && ram !== null ? pointAt(ram / PER_DEGREE, RADIUS) : null;
  return (
    <>
      {ghost && <circle cx={ghost.x} cy={ghost.y} r={6} className={classes.ghostEnd} />}
      <g
        role="slider"
        tabIndex={0}
        className={classes.end}
        transform={`translate(${place.x} ${place.y})`}
        aria-label={name}
        aria-valuenow={raw / PER_DEGREE}
        aria-valuemin={(bounds.low?.raw ?? raw) / PER_DEGREE}
        aria-valuemax={(bounds.high?.raw ?? raw) / PER_DEGREE}
        aria-valuetext={
          change ? t("page.setup.common.pending", { value: text, was: textOf(parameter, ram) }) : text
        }
        aria-disabled={lock !== null}
        onPointerDown={(event) => {
          if (event.button !== 0 || lock !== null) return;
          event.currentTarget.setPointerCapture(event.pointerId);
          grabbed.current = raw;
        }}
        onPointerMove={onPointerMove}
        onPointerUp={() => (grabbed.current = null)}
        onPointerCancel={() => {
          if (grabbed.current !== null) setRaw(parameter, grabbed.current);
          grabbed.current = null;
        }}
        onKeyDown={onKeyDown}
        onBlur={() => onStopped(null)}
        data-testid={`mark-${parameter.entry.address}`}
      >
        <circle r={16} className={classes.target} />
        <circle r={8} className={classes.knob} data-pending={change !== undefined} />
      </g>
    </>
  );
}
