import { IconPlayerPlay } from "@tabler/icons-react";
import type { Aligned } from "../../../api/overlay";
import { spanAt } from "../../../model/tracks";
import { localise } from "../../../model/values";
import { type Translate, useTexts } from "../../../texts/texts";
import { dateAndTime, lastOf, timeOfDay } from "../../../ui/format";
import type { Zero } from "./choice";
import { COLOURS, type Curve, type OverlayPlot } from "./curves";
import classes from "./Overlay.module.css";
import { msText, useOpenAt } from "./reading";

interface Props {
  recordings: readonly Aligned[];
  plots: readonly OverlayPlot[];
  hoverMs: number | null;
}

/** Which colour is which recording, and what all curves say at the pointer, or at the zero. */
export function Legend({ recordings, plots, hoverMs }: Props) {
  const t = useTexts();
  const open = useOpenAt();
  const shown = recordings.filter((one) => one.tracks.length > 0);
  if (shown.length === 0) return null;
  const atMs = hoverMs ?? 0;
  const curves = plots.flatMap((plot) => plot.curves.map((curve) => ({ plot, curve })));
  return (
    <div className={classes.legend}>
      <table>
        <caption data-testid="overlay-at">
          {hoverMs === null
            ? t("page.overlay.at_zero")
            : t("page.overlay.at", {
                time: msText((text) => localise(text, t.language))(Math.round(atMs * 10) / 10),
              })}
        </caption>
        <tbody>
          {shown.map((recording) => (
            <tr key={recording.name}>
              <th scope="row">
                <button
                  type="button"
                  onClick={() => open(recording, 0)}
                  title={t("page.overlay.open", { name: recording.name })}
                  data-testid={`overlay-open-${recording.name}`}
                >
                  <i
                    className={classes.dot}
                    style={{ background: `var(--overlay-${recordings.indexOf(recording) % COLOURS})` }}
                    aria-hidden
                  />
                  {recording.turbine.toUpperCase()} {zeroOf(recording)}
                  <IconPlayerPlay size={15} aria-hidden />
                </button>
              </th>
              <td>
                {curves
                  .filter(({ curve }) => curve.recording === recording)
                  .map(({ plot, curve }) => (
                    <Reading key={curve.id} plot={plot} curve={curve} atMs={atMs} t={t} />
                  ))}
              </td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}

function zeroOf({ t0_ns }: Aligned): string {
  if (t0_ns === null) return "";
  return `${dateAndTime(t0_ns / 1e6)}${timeOfDay(t0_ns / 1e6).slice(5)}`;
}

interface ReadingProps {
  plot: OverlayPlot;
  curve: Curve;
  atMs: number;
  t: Translate;
}

function Reading({ plot, curve, atMs, t }: ReadingProps) {
  const { line } = curve;
  const device = line.device === null ? `${line.bus}/${line.node}` : lastOf(line.device);
  const known = atMs <= curve.recording.to_ms ? spanAt(curve.track, atMs) : null;
  const number = (value: number) =>
    localise(String(Number(value.toPrecision(6))).replace("-", "−"), t.language);
  const text =
    known === null
      ? "–"
      : known.low === known.high
        ? number(known.low)
        : `${number(known.low)} … ${number(known.high)}`;
  return (
    <span className={classes.reading} title={`${device} ${t.nameOf(plot.title)}`}>
      <svg viewBox="0 0 22 8" aria-hidden>
        <line
          x1={0}
          x2={22}
          y1={4}
          y2={4}
          stroke={`var(--overlay-${curve.colour})`}
          strokeWidth={2.5}
          strokeDasharray={curve.dash.join(" ")}
        />
      </svg>
      <span className="dim">
        {line.blade === null ? device : t("page.overlay.short_blade", { blade: line.blade })} {line.address}
      </span>
      <b data-testid={`overlay-value-${curve.id}`}>
        {text} {plot.unit}
      </b>
    </span>
  );
}

/** Recordings that could not be laid over, each with its reason, and signals that one does not hold. */
export function NotShown({ recordings, gone }: Pick<Props, "recordings"> & { gone: readonly Zero[] }) {
  const t = useTexts();
  const failed = recordings.filter((one) => one.problem != null || one.tracks.length === 0);
  if (failed.length + gone.length === 0) return null;
  return (
    <ul className={classes.problems} role="status" data-testid="overlay-problems">
      {gone.map(({ name }) => (
        <li key={name}>{t("page.recordings.gone", { name })}</li>
      ))}
      {failed.map(({ name, problem, problem_details: details }) => (
        <li key={name}>
          <strong>{name}</strong>{" "}
          {problem == null ? t("page.overlay.no_signals") : t(problem, { ...details })}{" "}
          {problem === "error.index_missing" && t("page.overlay.index_next")}
        </li>
      ))}
    </ul>
  );
}
