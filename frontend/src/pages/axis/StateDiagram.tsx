import { useTexts } from "../../texts/texts";
import classes from "./Axis.module.css";

interface Box {
  name: string;
  x: number;
  y: number;
}

const WIDTH = 156;
const HEIGHT = 36;
const LEFT = 2;
const RIGHT = 176;

/** The states of CiA 402 in the arrangement of the standard: power off above, operation below, faults to the right. */
const BOXES: readonly Box[] = [
  { name: "not_ready_to_switch_on", x: LEFT, y: 4 },
  { name: "switch_on_disabled", x: LEFT, y: 66 },
  { name: "ready_to_switch_on", x: LEFT, y: 128 },
  { name: "switched_on", x: LEFT, y: 190 },
  { name: "operation_enabled", x: LEFT, y: 252 },
  { name: "quick_stop_active", x: RIGHT, y: 190 },
  { name: "fault", x: RIGHT, y: 66 },
  { name: "fault_reaction_active", x: RIGHT, y: 4 },
];

/** Transitions as paths; an arrow stands at each end that can be reached. */
const PATHS: readonly { d: string; both?: boolean }[] = [
  { d: "M80 40 V64" },
  { d: "M80 102 V126", both: true },
  { d: "M80 164 V188", both: true },
  { d: "M80 226 V250", both: true },
  { d: "M158 270 H254 V228" },
  { d: "M254 188 V146 H168 V92 H160" },
  { d: "M254 40 V64" },
  { d: "M175 78 H160" },
];

export function StateDiagram({ state, stale }: { state: string | null; stale: boolean }) {
  const t = useTexts();
  const current = state?.split(".").at(-1);
  const words = t("page.axis.machine_state", { state_key: state ?? "page.axis.state_unknown" });
  return (
    <svg
      viewBox="0 0 334 292"
      className={classes.machine}
      role="img"
      aria-label={words}
      data-testid="state-diagram"
      data-state={current ?? "unknown"}
      data-stale={stale}
    >
      <defs>
        <marker
          id="arrow"
          viewBox="0 0 8 8"
          refX="6"
          refY="4"
          markerWidth="7"
          markerHeight="7"
          orient="auto-start-reverse"
        >
          <path d="M0 0 L8 4 L0 8 z" fill="var(--hs-dim)" />
        </marker>
      </defs>
      {PATHS.map(({ d, both }) => (
        <path
          key={d}
          d={d}
          className={classes.transition}
          markerEnd="url(#arrow)"
          {...(both === true ? { markerStart: "url(#arrow)" } : {})}
        />
      ))}
      {BOXES.map(({ name, x, y }) => (
        <g key={name} className={classes.stateBox} data-current={name === current} data-name={name}>
          <rect x={x} y={y} width={WIDTH} height={HEIGHT} rx={6} />
          <text x={x + WIDTH / 2} y={y + HEIGHT / 2 + 5}>
            {name === current ? "▸ " : ""}
            {t(`axis_state.${name}`)}
          </text>
        </g>
      ))}
    </svg>
  );
}
