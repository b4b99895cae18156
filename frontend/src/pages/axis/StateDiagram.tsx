import { useTexts } from "../../texts/texts";
import classes from "./Axis.module.css";
import { commandsFrom, type Transition, TRANSITIONS, WORDS } from "./transitions";

interface Box {
  name: string;
  x: number;
  y: number;
}

const WIDTH = 156;
const HEIGHT = 36;
const LEFT = 2;
const RIGHT = 250;

/** The states of CiA 402 in the arrangement of the standard: power off above, operation below, faults to the right. */
const BOXES: readonly Box[] = [
  { name: "not_ready_to_switch_on", x: LEFT, y: 4 },
  { name: "switch_on_disabled", x: LEFT, y: 76 },
  { name: "ready_to_switch_on", x: LEFT, y: 148 },
  { name: "switched_on", x: LEFT, y: 220 },
  { name: "operation_enabled", x: LEFT, y: 292 },
  { name: "quick_stop_active", x: RIGHT, y: 220 },
  { name: "fault", x: RIGHT, y: 76 },
  { name: "fault_reaction_active", x: RIGHT, y: 4 },
];

/** The state machine of an axis: where it is, and on the arrows what can be commanded from there. */
export function StateDiagram({ state, stale }: { state: string | null; stale: boolean }) {
  const t = useTexts();
  const current = state?.split(".").at(-1);
  const words = t("page.axis.machine_state", { state_key: state ?? "page.axis.state_unknown" });
  const allowed = commandsFrom(stale ? undefined : current);
  // What can be commanded is drawn last, over the lines that it crosses.
  const arrows = TRANSITIONS.toSorted((a, b) => Number(allowed.includes(a)) - Number(allowed.includes(b)));
  return (
    <div className={classes.machinePicture}>
      <svg
        viewBox="0 0 410 350"
        className={classes.machine}
        role="img"
        aria-label={words}
        data-testid="state-diagram"
        data-state={current ?? "unknown"}
        data-stale={stale}
      >
        <defs>
          <Head id="arrow" colour="var(--hs-dim)" />
          <Head id="arrow-lit" colour="var(--hs-accent)" />
        </defs>
        {arrows.map((one) => (
          <Arrow key={one.number} transition={one} lit={allowed.includes(one)} />
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
      <div className={classes.allowed}>
        <h3>{t("page.axis.allowed")}</h3>
        <ul className={classes.commands} data-testid="allowed-commands">
          {allowed.length === 0 && <li className="dim">{t("page.axis.allowed_none")}</li>}
          {allowed.map(({ number, command, to }) => (
            <li key={number}>
              <span className={classes.number}>{number}</span>
              <span>
                <strong>{t(`command.${command ?? ""}`)}</strong> {command === null ? "" : WORDS[command]}
              </span>
              <span className="dim">→ {t(`axis_state.${to}`)}</span>
            </li>
          ))}
        </ul>
      </div>
    </div>
  );
}

function Head({ id, colour }: { id: string; colour: string }) {
  return (
    <marker
      id={id}
      viewBox="0 0 8 8"
      refX="6"
      refY="4"
      markerWidth="9"
      markerHeight="9"
      markerUnits="userSpaceOnUse"
      orient="auto"
    >
      <path d="M0 0 L8 4 L0 8 z" fill={colour} />
    </marker>
  );
}

function Arrow({ transition, lit }: { transition: Transition; lit: boolean }) {
  const { number, path, at, command } = transition;
  return (
    <g className={classes.transition} data-lit={lit} data-own={command === null} data-number={number}>
      <path d={path} markerEnd={`url(#${lit ? "arrow-lit" : "arrow"})`} />
      <text x={at[0]} y={at[1]}>
        {number}
      </text>
    </g>
  );
}
