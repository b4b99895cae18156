/** A small line of numbers from 0 to `max`, the newest at the right. */
const WIDTH = 74;
const HEIGHT = 30;
const POINTS = 60;

interface Props {
  values: readonly number[];
  max: number;
  className: string;
  label: string;
}

export function Sparkline({ values, max, className, label }: Props) {
  const step = WIDTH / (POINTS - 1);
  const start = WIDTH - (values.length - 1) * step;
  const y = (value: number) => HEIGHT - 1 - Math.min(1, value / max) * (HEIGHT - 2);
  const points = values.map((value, at) => `${(start + at * step).toFixed(1)},${y(value).toFixed(1)}`);
  return (
    <svg className={className} viewBox={`0 0 ${WIDTH} ${HEIGHT}`} role="img" aria-label={label}>
      <rect width={WIDTH} height={HEIGHT} rx={3} fill="var(--hs-panel-2)" />
      <polygon
        points={`${start.toFixed(1)},${HEIGHT} ${points.join(" ")} ${WIDTH},${HEIGHT}`}
        fill="var(--hs-accent)"
        opacity={0.25}
      />
      <polyline points={points.join(" ")} fill="none" stroke="var(--hs-accent)" strokeWidth={1.5} />
    </svg>
  );
}
