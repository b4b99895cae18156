import type { Timeline as Content } from "../api/replay";
import { figure } from "../model/values";
import { type Translate, useTexts } from "../texts/texts";
import { useDeviceName } from "../ui/devices";
import { timeOfDay } from "../ui/format";
import { type Stretch, useHover } from "./looking";
import type { Marked } from "./marked";
import classes from "./Replay.module.css";
import { lengthOf, placeOf } from "./timelineView";

/** So near, as a share of what is in view, a mark counts as pointed at. */
const NEAR = 0.006;
const MOST = 4;

interface Props {
  content: Content | null;
  marked: readonly Marked[];
  view: Stretch;
}

/** The time under the pointer, and what is there. */
export function TimelineHover({ content, marked, view }: Props) {
  const t = useTexts();
  const nameOf = useDeviceName();
  const tNs = useHover();
  if (tNs === null || tNs < view.fromNs || tNs > view.toNs) return null;
  const share = placeOf(tNs, view, 1);
  const nearNs = lengthOf(view) * NEAR;
  const noted = marked
    .filter(({ fromNs, toNs }) => fromNs - nearNs <= tNs && tNs <= toNs + nearNs)
    .map(({ kind, text }) => t(`page.replay.marked.${kind}`, { text }));
  const lines = [...noted, ...(content === null ? [] : linesAt(content, tNs, nearNs, t, nameOf))];
  return (
    <div
      className={classes.hover}
      style={share > 0.5 ? { right: `${(1 - share) * 100}%` } : { left: `${share * 100}%` }}
      data-testid="timeline-hover"
      aria-hidden
    >
      <strong>{timeOfDay(tNs / 1e6)}</strong>
      {lines.map((line) => (
        <span key={line}>{line}</span>
      ))}
    </div>
  );
}

function linesAt(
  content: Content,
  tNs: number,
  nearNs: number,
  t: Translate,
  nameOf: (slug: string) => string,
): string[] {
  const marks = content.marks
    .filter((mark) => Math.abs(mark.t_ns - tNs) <= nearNs)
    .toSorted((a, b) => Math.abs(a.t_ns - tNs) - Math.abs(b.t_ns - tNs))
    .slice(0, MOST)
    .map((mark) => {
      const device = mark.device === null ? "" : `${nameOf(mark.device)}: `;
      return `${timeOfDay(mark.t_ns / 1e6)} ${device}${t(mark.text_key, mark.details)}`;
    });
  const gaps = content.gaps
    .filter((gap) => gap.from_ns - nearNs <= tNs && tNs <= gap.to_ns + nearNs)
    .map((gap) => t(gap.text_key, gap.details));
  const bucket = Math.floor((tNs - content.from_ns) / content.bucket_ns);
  const loads = content.load.flatMap(({ bus, share }) => {
    const used = share[bucket] ?? null;
    return used === null ? [] : [t("page.replay.load", { bus, load: figure(used * 100, 0, t.language) })];
  });
  return [...new Set([...gaps, ...marks, ...loads])];
}
