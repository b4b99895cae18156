import { useDeviceVersion } from "../../live/live";
import type { DeviceContext } from "../../model/shown";
import { figure } from "../../model/values";
import { measuresOf, wayPerS } from "../../motion/axis";
import { boundsOf } from "../../motion/drive";
import motion from "../../motion/Motion.module.css";
import { type Profile, profileOf, shareAt } from "../../motion/profile";
import { useTexts } from "../../texts/texts";

interface Props {
  context: DeviceContext;
  /** In the units of the axis. */
  from: number;
  to: number;
  speed: number;
}

const WIDTH = 260;
const HEIGHT = 64;
const POINTS = 60;

/** What will come of a move, by the ramps and limits that the drive holds now. */
export function Preview({ context, from, to, speed }: Props) {
  const t = useTexts();
  useDeviceVersion(context.slug);
  const bounds = boundsOf(context, speed);
  const { lowest, highest, ramps } = bounds;
  const measures = measuresOf(context);
  const perS = wayPerS(measures.position.unit, measures.speed.unit);
  // The way is told in units of position, speeds in units of speed: what both have in common is a factor.
  const profile = perS === null ? null : profileOf((to - from) / perS, ramps);
  const seconds = (s: number) => figure(s, 1, t.language);
  const place = (number: number) => figure(number, measures.position.decimals, t.language);
  const pace = (number: number) => figure(number, measures.speed.decimals, t.language);
  const beyond = (lowest !== null && to < lowest) || (highest !== null && to > highest);
  return (
    <div className={motion.preview} data-testid="preview" data-beyond={beyond}>
      {profile && <Curve profile={profile} falling={to < from} />}
      <p>
        {profile === null
          ? t("page.motion.preview_unknown")
          : t("page.motion.preview_axis", {
              total: seconds(profile.totalS),
              up: seconds(profile.upS),
              steady: seconds(profile.steadyS),
              down: seconds(profile.downS),
              peak: pace(profile.peakDps),
              unit: measures.speed.unit,
            })}
      </p>
      {lowest !== null && highest !== null && (
        <p className={beyond ? "tone-error" : "dim"}>
          {t(beyond ? "page.motion.preview_axis_beyond" : "page.motion.preview_axis_within", {
            low: place(lowest),
            high: place(highest),
            unit: measures.position.unit,
          })}
        </p>
      )}
      {bounds.unlimited && <p className="dim">{t("page.motion.preview_no_limits")}</p>}
      {bounds.bounded !== null && (
        <p className="tone-warning">
          {t("page.motion.preview_axis_bounded", {
            speed: pace(ramps.speedDps),
            unit: measures.speed.unit,
            object: `${bounds.bounded}h`,
          })}
        </p>
      )}
    </div>
  );
}

/** Angle and speed over time, both from end to end. */
function Curve({ profile, falling }: { profile: Profile; falling: boolean }) {
  const { totalS, upS, steadyS, peakDps } = profile;
  if (totalS === 0) return null;
  const x = (atS: number) => (WIDTH * atS) / totalS;
  const y = (share: number) => 4 + (HEIGHT - 8) * (falling ? share : 1 - share);
  const angle = Array.from({ length: POINTS + 1 }, (_, n) => (totalS * n) / POINTS)
    .map((atS) => `${x(atS).toFixed(1)},${y(shareAt(profile, atS)).toFixed(1)}`)
    .join(" ");
  const base = HEIGHT - 4;
  const speed = peakDps > 0 ? `0,${base} ${x(upS)},8 ${x(upS + steadyS)},8 ${WIDTH},${base}` : "";
  return (
    <svg viewBox={`0 0 ${WIDTH} ${HEIGHT}`} className={motion.curve} aria-hidden>
      <polyline points={speed} className={motion.speedCurve} />
      <polyline points={angle} className={motion.angleCurve} />
    </svg>
  );
}
