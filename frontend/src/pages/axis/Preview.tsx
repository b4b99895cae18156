import type { StationRef } from "../../api/types";
import { alike } from "../../live/alike";
import { useDerived } from "../../live/live";
import type { LiveStore } from "../../live/store";
import type { DeviceContext } from "../../model/shown";
import { figure } from "../../model/values";
import { axisNowIn, measuresOf, wayPerS } from "../../motion/axis";
import { boundsOf } from "../../motion/drive";
import motion from "../../motion/Motion.module.css";
import { type Profile, profileOf, shareAt } from "../../motion/profile";
import { type Translate, useTexts } from "../../texts/texts";

interface Props {
  station: StationRef;
  context: DeviceContext;
  /** In the units of the axis. */
  to: number;
  speed: number;
}

/** While the axis moves it comes out otherwise all the time: nobody reads it faster. */
const RENEW_MS = 200;
const WIDTH = 260;
const HEIGHT = 64;
const POINTS = 60;

interface Outlook {
  beyond: boolean;
  falling: boolean;
  profile: Profile | null;
  way: string;
  limits: string | null;
  unlimited: boolean;
  bounded: string | null;
}

/** What will come of a move, by the ramps and limits that the drive holds now. */
export function Preview({ station, context, to, speed }: Props) {
  const t = useTexts();
  const outlook = useDerived([], (store) => outlookOf(store, station, context, to, speed, t), {
    everyMs: RENEW_MS,
    same: sameWords,
  });
  if (outlook === null) return null;
  const { beyond, falling, profile, way, limits, unlimited, bounded } = outlook;
  return (
    <div className={motion.preview} data-testid="preview" data-beyond={beyond}>
      {profile && <Curve profile={profile} falling={falling} />}
      <p>{way}</p>
      {limits !== null && <p className={beyond ? "tone-error" : "dim"}>{limits}</p>}
      {unlimited && <p className="dim">{t("page.motion.preview_no_limits")}</p>}
      {bounded !== null && <p className="tone-warning">{bounded}</p>}
    </div>
  );
}

/** The curve is drawn by what the words say: it has no finer resolution. */
function sameWords(one: Outlook | null, other: Outlook | null): boolean {
  if (one === null || other === null) return one === other;
  return alike({ ...one, profile: one.profile !== null }, { ...other, profile: other.profile !== null });
}

/** Null where nobody knows where the axis stands. */
function outlookOf(
  store: LiveStore,
  station: StationRef,
  context: DeviceContext,
  to: number,
  speed: number,
  t: Translate,
): Outlook | null {
  const from = axisNowIn(store, station, context, false).position;
  if (from === null) return null;
  const { lowest, highest, ramps, unlimited, bounded } = boundsOf(context, speed);
  const measures = measuresOf(context);
  const perS = wayPerS(measures.position.unit, measures.speed.unit);
  // The way is told in units of position, speeds in units of speed: what both have in common is a factor.
  const profile = perS === null ? null : profileOf((to - from) / perS, ramps);
  const place = (number: number) => figure(number, measures.position.decimals, t.language);
  const pace = (number: number) => figure(number, measures.speed.decimals, t.language);
  const beyond = (lowest !== null && to < lowest) || (highest !== null && to > highest);
  return {
    beyond,
    falling: to < from,
    profile,
    way: wayText(profile, pace, measures.speed.unit, t),
    limits:
      lowest === null || highest === null
        ? null
        : t(beyond ? "page.motion.preview_axis_beyond" : "page.motion.preview_axis_within", {
            low: place(lowest),
            high: place(highest),
            unit: measures.position.unit,
          }),
    unlimited,
    bounded:
      bounded === null
        ? null
        : t("page.motion.preview_axis_bounded", {
            speed: pace(ramps.speedDps),
            unit: measures.speed.unit,
            object: `${bounded}h`,
          }),
  };
}

function wayText(
  profile: Profile | null,
  pace: (speed: number) => string,
  unit: string,
  t: Translate,
): string {
  if (profile === null) return t("page.motion.preview_unknown");
  const seconds = (s: number) => figure(s, 1, t.language);
  return t("page.motion.preview_axis", {
    total: seconds(profile.totalS),
    up: seconds(profile.upS),
    steady: seconds(profile.steadyS),
    down: seconds(profile.downS),
    peak: pace(profile.peakDps),
    unit,
  });
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
