import type { Sample } from "../../../../api/battery";
import { figure } from "../../../../model/values";
import { useTexts } from "../../../../texts/texts";
import classes from "./Battery.module.css";
import { curve } from "./blocs";

const BOX = { width: 600, height: 150 };
const LEAST_MS = 5000;

/** Voltage and current over the time of a test; the scale of each is its own least and greatest. */
export function Course({ course, tookMs }: { course: readonly Sample[]; tookMs: number }) {
  const t = useTexts();
  const times = course.map((one) => one.t_ms);
  const untilMs = Math.max(LEAST_MS, tookMs, times.at(-1) ?? 0);
  const line = (values: readonly (number | null)[]) => {
    const known = values.filter((one): one is number => one !== null);
    const [low, high] = known.length > 0 ? [Math.min(...known), Math.max(...known)] : [0, 1];
    return { low, high, points: curve(values, times, { ...BOX, low, high, untilMs }) };
  };
  const volts = line(course.map((one) => one.battery_v));
  const amps = line(course.map((one) => (one.current_ma === null ? null : one.current_ma / 1000)));
  const text = t("page.setup.battery.course", {
    low: volts.low,
    high: volts.high,
    least: figure(amps.low, 1, t.language),
    most: figure(amps.high, 1, t.language),
    seconds: figure(untilMs / 1000, 0, t.language),
  });
  return (
    <figure style={{ margin: "6px 0" }} data-testid="course">
      <svg
        className={classes.course}
        viewBox={`-4 -4 ${BOX.width + 8} ${BOX.height + 8}`}
        preserveAspectRatio="none"
        role="img"
        aria-label={text}
      >
        <polyline className={classes.amps} points={amps.points} vectorEffect="non-scaling-stroke" />
        <polyline className={classes.volts} points={volts.points} vectorEffect="non-scaling-stroke" />
      </svg>
      <figcaption className={classes.courseLegend}>
        <span>━ {t("page.setup.battery.course_volts", { low: volts.low, high: volts.high })}</span>
        <span>
          ╍{" "}
          {t("page.setup.battery.course_amps", {
            low: figure(amps.low, 1, t.language),
            high: figure(amps.high, 1, t.language),
          })}
        </span>
        <span className="dim">0 … {figure(untilMs / 1000, 0, t.language)} s</span>
      </figcaption>
    </figure>
  );
}
