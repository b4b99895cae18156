import "uplot/dist/uPlot.min.css";
import { useComputedColorScheme } from "@mantine/core";
import { useEffect, useRef } from "react";
import UPlot from "uplot";
import type { SignalRun } from "../../../api/signals";
import { localise } from "../../../model/values";
import { useTexts } from "../../../texts/texts";
import { type Line, table } from "./plotData";
import classes from "./Signal.module.css";

interface Props {
  run: SignalRun;
  earlier?: SignalRun | undefined;
  lines: readonly Line[];
  title: string;
  unit: string;
  height: number;
  /** The scale never closes in below this, so that noise does not look like motion. */
  leastSpan: number;
  testId: string;
}

/** Courses of one run, and of an earlier one laid over it, from the first target on. */
export function ResponsePlot({ run, earlier, lines, title, unit, height, leastSpan, testId }: Props) {
  const t = useTexts();
  const { language } = t;
  const holder = useRef<HTMLDivElement>(null);
  const scheme = useComputedColorScheme();
  useEffect(() => {
    const element = holder.current;
    if (!element) return;
    const show = (text: string) => localise(text, language);
    const drawn = new UPlot(options(element, lines, leastSpan, show), table(run, earlier, lines), element);
    const observer = new ResizeObserver(() =>
      drawn.setSize({ width: element.clientWidth, height: element.clientHeight }),
    );
    observer.observe(element);
    return () => {
      observer.disconnect();
      drawn.destroy();
    };
  }, [run, earlier, lines, leastSpan, scheme, language]);
  return (
    <figure className={classes.plot}>
      <figcaption>
        {title} <span className="dim">{unit}</span>
        <span className={classes.legend}>
          {lines.map((line) => (
            <span key={line.earlier ? "earlier" : line.of}>
              <svg width="26" height="8" aria-hidden>
                <line
                  x1="0"
                  x2="26"
                  y1="4"
                  y2="4"
                  stroke={`var(${line.colour})`}
                  strokeWidth={line.width ?? 2}
                  strokeDasharray={line.dash?.join(" ")}
                />
              </svg>
              {t(`page.signal.course.${line.earlier ? "earlier" : line.of}`)}
            </span>
          ))}
        </span>
      </figcaption>
      <div
        ref={holder}
        className={classes.plotBody}
        style={{ height }}
        role="img"
        aria-label={title}
        data-testid={testId}
      />
    </figure>
  );
}

const stepped = UPlot.paths.stepped?.({ align: 1 });

function options(
  element: HTMLElement,
  lines: readonly Line[],
  leastSpan: number,
  show: (text: string) => string,
): UPlot.Options {
  const style = getComputedStyle(element);
  const colour = (name: string) => style.getPropertyValue(name).trim();
  const axis: UPlot.Axis = {
    stroke: colour("--hs-dim"),
    font: `11px ${style.fontFamily}`,
    grid: { stroke: colour("--hs-line"), width: 1 },
    ticks: { show: false },
  };
  const figures = (splits: number[]) => {
    const decimals = Math.max(
      ...splits.map((at) => (String(Number(at.toFixed(3))).split(".")[1] ?? "").length),
    );
    return splits.map((at) => show(at.toFixed(decimals)));
  };
  return {
    width: element.clientWidth,
    height: element.clientHeight,
    legend: { show: false },
    cursor: { show: false },
    padding: [6, 14, 0, 0],
    scales: { x: { time: false }, y: { range: (_plot, low, high) => spanOf(low, high, leastSpan) } },
    axes: [
      { ...axis, size: 18, gap: 2, values: (_plot, splits) => figures(splits).map((text) => `${text} s`) },
      { ...axis, size: 50, gap: 4, space: 24, values: (_plot, splits) => figures(splits) },
    ],
    series: [
      {},
      ...lines.map(({ colour: name, dash, width, stepped: steps }): UPlot.Series => ({
        stroke: colour(name),
        width: width ?? 2,
        spanGaps: true,
        points: { show: false },
        ...(dash ? { dash } : {}),
        ...(steps && stepped ? { paths: stepped } : {}),
      })),
    ],
  };
}

function spanOf(low: number | null, high: number | null, least: number): [number, number] {
  if (low === null || high === null) return [-least / 2, least / 2];
  const half = Math.max(least, (high - low) * 1.12) / 2;
  const middle = (low + high) / 2;
  return [middle - half, middle + half];
}
