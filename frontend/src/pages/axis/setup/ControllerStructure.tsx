import { useCell } from "../../../live/live";
import { shownOf, type DeviceContext } from "../../../model/shown";
import { useTexts } from "../../../texts/texts";
import { entriesOf } from "../../../ui/reading";
import classes from "../signal/Signal.module.css";

/** The value of an object with its unit as it is known now; a dash where it is not. */
function useValue(context: DeviceContext, address: string): string {
  const cell = useCell(context.slug, address);
  const entry = entriesOf(context.doc).get(address);
  if (!entry || !cell?.known || cell.raw === null) return "–";
  const { text, unit } = shownOf(entry, cell.raw, context);
  return unit === "" ? text : `${text} ${unit}`;
}

/** How the position controller works, with what is in force: ramps, pre-control, gain, limit, velocity loop. */
export function ControllerStructure({ pmc }: { pmc: DeviceContext }) {
  const t = useTexts();
  const text = (key: string) => t(`page.setup.controller.${key}`);
  const values = {
    up: useValue(pmc, "6083"),
    down: useValue(pmc, "6084"),
    gain: useValue(pmc, "60FB:01"),
    precontrol: useValue(pmc, "60FB:02"),
    limit: useValue(pmc, "6080"),
    p: useValue(pmc, "60F9:01"),
    filter: useValue(pmc, "60F9:05"),
    brake: useValue(pmc, "60F9:04"),
    window: useValue(pmc, "6065"),
    error: useValue(pmc, "60F4"),
    actual: useValue(pmc, "6064"),
  };
  const label = `${text("structure")}: ${text("gain")} ${values.gain}, ${text("precontrol")} ${values.precontrol}`;
  return (
    <svg
      className={classes.structure}
      viewBox="0 0 960 220"
      role="img"
      aria-label={label}
      data-testid="structure"
    >
      <defs>
        <marker id="controller-tip" markerWidth="8" markerHeight="8" refX="7" refY="4" orient="auto">
          <path d="M1,1 L7,4 L1,7" />
        </marker>
      </defs>
      <g markerEnd="url(#controller-tip)">
        <path d="M12,110 H68" />
        <path d="M190,110 H247" />
        <path d="M215,110 V40 H325" />
        <path d="M273,110 H325" />
        <path d="M455,110 H507" />
        <path d="M455,40 H520 V97" />
        <path d="M533,110 H585" />
        <path d="M705,110 H757" />
        <path d="M857,110 H945" />
        <path d="M900,110 V190 H260 V123" />
      </g>
      <circle cx="260" cy="110" r="12" />
      <circle cx="520" cy="110" r="12" />
      <text x="246" y="140">
        −
      </text>
      <text x="40" y="100" data-kind="dim">
        {text("demand")}
      </text>
      <Block x={70} y={80} width={120} title={text("ramps")} value={values.up} below={`↓ ${values.down}`} />
      <Block
        x={327}
        y={10}
        width={128}
        title={text("precontrol")}
        value={values.precontrol}
        below="60FBh/2"
      />
      <Block x={327} y={80} width={128} title={text("gain")} value={values.gain} below="60FBh/1" />
      <text x="390" y="162" data-kind="dim">
        {`${text("following")} ${values.error} · ${t("page.setup.controller.window", { value: values.window })}`}
      </text>
      <Block
        x={587}
        y={80}
        width={118}
        title={text("velocity_loop")}
        value={values.p}
        below={`${text("limit")} ${values.limit}`}
      />
      <text x="646" y="162" data-kind="dim">
        {`${text("filter")} 2^${values.filter} ms`}
      </text>
      <Block
        x={759}
        y={80}
        width={98}
        title={text("axis")}
        value=""
        below={`${text("brake")} ${values.brake}`}
      />
      <text x="646" y="184" data-kind="dim">
        {`${text("actual")} ${values.actual}`}
      </text>
    </svg>
  );
}

interface BlockProps {
  x: number;
  y: number;
  width: number;
  title: string;
  value: string;
  below: string;
}

function Block({ x, y, width, title, value, below }: BlockProps) {
  const middle = x + width / 2;
  return (
    <g>
      <rect x={x} y={y} width={width} height="60" rx="6" />
      <text x={middle} y={y + 18}>
        {title}
      </text>
      <text x={middle} y={y + 36} data-kind="value">
        {value}
      </text>
      <text x={middle} y={y + 53} data-kind="dim">
        {below}
      </text>
    </g>
  );
}
