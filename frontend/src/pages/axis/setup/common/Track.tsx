import type { ReactNode } from "react";
import { type Scale, shareOf, ticksOf } from "./scale";
import classes from "./Setup.module.css";

export interface Band {
  key: string;
  from: number;
  to: number;
  tone: "cold" | "warm" | "room" | "error" | "warning";
  row?: 0 | 1 | undefined;
  title: string;
}

export interface Line {
  key: string;
  at: number;
  stale: boolean;
  title: string;
  kind: "live" | "reference";
}

interface Props {
  scale: Scale;
  step: number;
  rows: 1 | 2;
  bands?: readonly Band[];
  lines?: readonly (Line | null)[];
  children?: ReactNode;
}

const at = (scale: Scale, value: number): string => `${100 * shareOf(scale, value)}%`;

/** One lane of a scale: bands, what is measured now, and marks above them. */
export function Track({ scale, step, rows, bands = [], lines = [], children }: Props) {
  return (
    <div className={classes.track} data-rows={rows}>
      {ticksOf(scale, step).map((tick) => (
        <i
          key={tick}
          className={classes.grid}
          style={{ left: at(scale, tick) }}
          data-zero={tick === 0}
          aria-hidden
        />
      ))}
      {bands.map((band) => (
        <i
          key={band.key}
          className={classes.band}
          data-tone={band.tone}
          data-row={band.row}
          title={band.title}
          style={{
            left: at(scale, band.from),
            width: `${100 * Math.max(0, shareOf(scale, band.to) - shareOf(scale, band.from))}%`,
          }}
          aria-hidden
        />
      ))}
      {lines.map(
        (line) =>
          line && (
            <i
              key={line.key}
              className={classes.line}
              data-kind={line.kind}
              data-stale={line.stale}
              style={{ left: at(scale, line.at) }}
              title={line.title}
              data-testid={`line-${line.key}`}
              aria-hidden
            />
          ),
      )}
      {children}
    </div>
  );
}

/** The numbers of a scale, above its lanes. */
export function Ticks({ scale, step, unit }: { scale: Scale; step: number; unit: string }) {
  return (
    <div className={classes.ticks} aria-hidden>
      {ticksOf(scale, step).map((tick) => (
        <span key={tick} style={{ left: at(scale, tick) }}>
          {tick}
        </span>
      ))}
      <em>{unit}</em>
    </div>
  );
}
