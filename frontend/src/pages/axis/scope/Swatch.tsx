/** The line by which a signal is drawn. */
export function Swatch({ colour, dash }: { colour: number; dash: readonly number[] }) {
  return (
    <svg width={18} height={10} viewBox="0 0 18 10" aria-hidden>
      <line
        x1={0}
        x2={18}
        y1={5}
        y2={5}
        stroke={`var(--scope-${colour})`}
        strokeWidth={2.5}
        strokeDasharray={dash.join(" ")}
      />
    </svg>
  );
}
