import type { BusLoadLine } from "../../api/trace";
import classes from "./Bus.module.css";

const SECONDS = 300;
const HEIGHT = 100;
const TICKS = [0.25, 0.5, 0.75, 1];

interface Props {
  seconds: BusLoadLine["seconds"];
  colours: ReadonlyMap<number, string>;
  label: string;
}

/** Five minutes of load, a column a second, each node's share in its colour; the newest at the right. */
export function LoadPlot({ seconds, colours, label }: Props) {
  const newest = seconds.at(-1)?.second ?? 0;
  const most = Math.max(0.05, ...seconds.map((second) => second.load));
  const top = TICKS.find((tick) => tick >= most) ?? 1;
  const y = (share: number) => HEIGHT - (share / top) * HEIGHT;
  const nodes = [0, ...colours.keys()];
  return (
    <div className={classes.plot}>
      <svg
        viewBox={`0 0 ${String(SECONDS)} ${String(HEIGHT)}`}
        preserveAspectRatio="none"
        role="img"
        aria-label={label}
      >
        {nodes.map((node, at) => (
          <path
            key={node}
            d={columnsOf(seconds, newest, nodes.slice(0, at), node, y)}
            fill={colours.get(node) ?? "var(--hs-dim)"}
          />
        ))}
      </svg>
      <span data-edge="top">{`${String(top * 100)} %`}</span>
      <span data-edge="bottom">0</span>
    </div>
  );
}

/** One path for all columns of a node, standing on those below it. */
function columnsOf(
  seconds: Props["seconds"],
  newest: number,
  below: readonly number[],
  node: number,
  y: (share: number) => number,
): string {
  return seconds
    .map((second) => {
      const share = second.nodes[String(node)] ?? 0;
      const x = SECONDS - 1 - (newest - second.second);
      if (share === 0 || x < 0) return "";
      const base = below.reduce((sum, one) => sum + (second.nodes[String(one)] ?? 0), 0);
      return `M${String(x)} ${y(base).toFixed(2)}h1V${y(base + share).toFixed(2)}h-1z`;
    })
    .join("");
}
