import { Select } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import type UPlot from "uplot";
import { type CaptureHead, xyQuery } from "../../../api/scope";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { Chart } from "./Chart";
import classes from "./Scope.module.css";
import type { Trace } from "./traces";
import { listOf, type Pair, stretchOf } from "./view";

interface Props {
  head: CaptureHead;
  traces: readonly Trace[];
  view: Pair;
  cursors: Pair | null;
  drawn: Map<string, UPlot>;
}

/** One signal over another. */
export function XyView({ head, traces, view, cursors, drawn }: Props) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const [wantedX, wantedY] = listOf(search.xy);
  const x = traces.find((one) => one.name === wantedX) ?? traces[0];
  const y = traces.find((one) => one.name === wantedY) ?? traces[1] ?? traces[0];
  const { data, error } = useQuery(xyQuery(head.id, x?.name ?? "", y?.name ?? "", stretchOf(cursors, view)));
  if (!x || !y) return null;
  const choice = (label: string, chosen: Trace, take: (name: string) => void) => (
    <Select
      label={label}
      data={traces.map((one) => ({ value: one.name, label: one.label }))}
      value={chosen.name}
      onChange={(name) => name !== null && take(name)}
      allowDeselect={false}
      w={360}
      data-testid={`xy-${label.toLowerCase()}`}
    />
  );
  const axis = (trace: Trace) => `${trace.label}${trace.unit === "" ? "" : `, ${trace.unit}`}`;
  return (
    <section className={classes.analysis}>
      <div className={classes.choices}>
        {choice(t("page.scope.xy_x"), x, (name) => update({ xy: `${name},${y.name}` }))}
        {choice(t("page.scope.xy_y"), y, (name) => update({ xy: `${x.name},${name}` }))}
      </div>
      {error && <ProblemAlert error={error} title={t("page.scope.view_failed")} />}
      {data && (
        <>
          <Chart
            x={data.x}
            y={data.y}
            colour={y.colour}
            label={t("page.scope.xy_plot", { x: x.label, y: y.label })}
            xUnit={axis(x)}
            yUnit={y.unit}
            fromZero={false}
            drawn={drawn}
            name="xy"
          />
          <p className={classes.told} data-testid="xy-told">
            {t(data.every === 1 ? "page.scope.xy_told" : "page.scope.xy_every", {
              count: data.instants,
              every: data.every,
            })}
          </p>
        </>
      )}
    </section>
  );
}
