import { useDeviceVersion } from "../../live/live";
import type { DeviceContext } from "../../model/shown";
import { figure } from "../../model/values";
import { boundsOf } from "../../motion/drive";
import motion from "../../motion/Motion.module.css";
import { type Profile, profileOf, shareAt } from "../../motion/profile";
import { useTexts } from "../../texts/texts";

interface Props {
  context: DeviceContext;
  fromDeg: number;
  toDeg: number;
  speedDps: number;
}

const WIDTH = 260;
const HEIGHT = 64;
const POINTS = 60;

/** What will come of a move, by the ramps and limits that the drive holds now. */
export function Preview({ context, fromDeg, toDeg, speedDps }: Props) {
  const t = useTexts();
  useDeviceVersion(context.slug);
  const bounds = boundsOf(context, speedDps);
  const { lowestDeg: lowest, highestDeg: highest, ramps } = bounds;
  const profile = profileOf(toDeg - fromDeg, ramps);
  const seconds = (s: number) => figure(s, 1, t.language);
  const degrees = (deg: number) => figure(deg, 2, t.language);
  const beyond = (lowest !== null && toDeg < lowest) || (highest !== null && toDeg > highest);
  return (
    <div className={motion.preview} data-testid="preview" data-beyond={beyond}>
      {profile && <Curve profile={profile} falling={toDeg < fromDeg} />}
      <p>
        {profile === null
          ? t("page.motion.preview_unknown")
          : t("page.motion.preview", {
              total: seconds(profile.totalS),
              up: seconds(profile.upS),
              steady: seconds(profile.steadyS),
              down: seconds(profile.downS),
              peak: degrees(profile.peakDps),
            })}
      </p>
      {lowest !== null && highest !== null && (
        <p className={beyond ? "tone-error" : "dim"}>
          {t(beyond ? "page.motion.preview_beyond" : "page.motion.preview_within", {
            low: degrees(lowest),
            high: degrees(highest),
          })}
        </p>
      )}
      {bounds.bounded !== null && (
        <p className="tone-warning">
          {t("page.motion.preview_bounded", { speed: degrees(ramps.speedDps), object: `${bounds.bounded}h` })}
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
