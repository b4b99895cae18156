import classes from "./Gear.module.css";

const MOST_TEETH = 40;
const [SMALL, LARGE] = [9, 24];

/** Two wheels that mesh, as large as their teeth are many. */
export function Wheels({ driving, driven }: { driving: number; driven: number }) {
  const most = Math.max(driving, driven, 1);
  const radius = (teeth: number) => SMALL + (LARGE - SMALL) * Math.sqrt(Math.max(teeth, 0) / most);
  const [first, second] = [radius(driving), radius(driven)];
  const left = 46 - (first + second) / 2;
  return (
    <svg viewBox="0 0 92 62" aria-hidden>
      <Wheel x={left} radius={first} teeth={driving} />
      <Wheel x={left + first + second} radius={second} teeth={driven} />
    </svg>
  );
}

function Wheel({ x, radius, teeth }: { x: number; radius: number; teeth: number }) {
  const shown = Math.min(MOST_TEETH, Math.max(8, Math.round(teeth)));
  const pitch = (2 * Math.PI * (radius - 2)) / shown / 2;
  return (
    <>
      <circle className={classes.wheel} cx={x} cy={31} r={radius - 4} />
      <circle
        className={classes.teeth}
        cx={x}
        cy={31}
        r={radius - 2}
        strokeDasharray={`${pitch.toFixed(2)} ${pitch.toFixed(2)}`}
      />
      <circle className={classes.solid} cx={x} cy={31} r={2.5} />
    </>
  );
}

/** An encoder: a disc with lines. */
export function Disc() {
  return (
    <svg viewBox="0 0 92 62" aria-hidden>
      <circle className={classes.wheel} cx={46} cy={31} r={22} />
      <circle className={classes.teeth} cx={46} cy={31} r={16} strokeDasharray="1.6 2.6" />
      <circle className={classes.solid} cx={46} cy={31} r={3} />
    </svg>
  );
}

/** A motor: its housing and shaft. */
export function Motor() {
  return (
    <svg viewBox="0 0 92 62" aria-hidden>
      <rect className={classes.wheel} x={14} y={12} width={52} height={38} rx={5} />
      <path className={classes.wheel} d="M24 12v38M34 12v38M44 12v38M54 12v38" />
      <rect className={classes.solid} x={66} y={27} width={18} height={8} />
    </svg>
  );
}

/** A blade at its root. */
export function BladeShape() {
  return (
    <svg viewBox="0 0 92 62" aria-hidden>
      <circle className={classes.wheel} cx={18} cy={31} r={12} />
      <path className={classes.wheel} d="M28 24C52 12 70 22 88 31C70 38 52 42 28 38Z" />
    </svg>
  );
}
