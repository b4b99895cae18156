import { useMemo } from "react";
import type { DescriptionDoc } from "../../api/types";
import { useTexts } from "../../texts/texts";
import classes from "./Axis.module.css";
import { type Arrow as ArrowView, CIA_402_VIEW, commandsFrom, HEIGHT, viewOf, WIDTH } from "./machineView";

interface Props {
  /** Null until it is there. */
  doc: DescriptionDoc | null;
  state: string | null;
  stale: boolean;
}

/** Transitions are counted; some manuals put letters before the number. */
const shortOf = (name: string) => name.replace(/^\D+/, "");

/** The state machine of an axis: where it is, and on the arrows what can be commanded from there. */
export function StateDiagram({ doc, state, stale }: Props) {
  const t = useTexts();
  const view = useMemo(() => (doc?.state_machine ? viewOf(doc.state_machine) : CIA_402_VIEW), [doc]);
  const current = state?.split(".").at(-1);
  const words = t("page.axis.machine_state", { state_key: state ?? "page.axis.state_unknown" });
  const allowed = commandsFrom(view, stale ? undefined : current);
  // What can be commanded is drawn last, over the lines that it crosses.
  const arrows = view.arrows.toSorted((a, b) => Number(allowed.includes(a)) - Number(allowed.includes(b)));
  return (
    <div className={classes.machinePicture}>
      <svg
        viewBox={`0 0 ${view.width} ${view.height}`}
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
          <Arrow key={one.name} arrow={one} lit={allowed.includes(one)} />
        ))}
        {view.boxes.map(({ name, textKey, x, y }) => (
          <g key={name} className={classes.stateBox} data-current={name === current} data-name={name}>
            <rect x={x} y={y} width={WIDTH} height={HEIGHT} rx={6} />
            <text x={x + WIDTH / 2} y={y + HEIGHT / 2 + 5}>
              {name === current ? "▸ " : ""}
              {t(textKey)}
            </text>
          </g>
        ))}
      </svg>
      <div className={classes.allowed}>
        <h3>{t("page.axis.allowed")}</h3>
        <ul className={classes.commands} data-testid="allowed-commands">
          {allowed.length === 0 && <li className="dim">{t("page.axis.allowed_none")}</li>}
          {allowed.map(({ name, commandKey, word, toKey }) => (
            <li key={name}>
              <span className={classes.number}>{shortOf(name)}</span>
              <span>
                <strong>{t(commandKey ?? "")}</strong> {word}
              </span>
              <span className="dim">→ {t(toKey)}</span>
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

function Arrow({ arrow, lit }: { arrow: ArrowView; lit: boolean }) {
  const { name, path, at, commandKey } = arrow;
  return (
    <g className={classes.transition} data-lit={lit} data-own={commandKey === null} data-number={name}>
      <path d={path} markerEnd={`url(#${lit ? "arrow-lit" : "arrow"})`} />
      <text x={at[0]} y={at[1]}>
        {shortOf(name)}
      </text>
    </g>
  );
}
