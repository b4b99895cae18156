import { useElementSize } from "@mantine/hooks";
import { useQuery } from "@tanstack/react-query";
import { useMemo, useState } from "react";
import { recordingsQuery } from "../../../api/files";
import { alignQuery } from "../../../api/overlay";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { Chooser } from "./Chooser";
import { CurveTools } from "./CurveTools";
import {
  type Curve,
  curvesText,
  fileOf,
  parseCurves,
  parseSpan,
  parseZeros,
  requestOf,
  type Span,
  spanText,
  USUAL_CURVES,
  USUAL_SPAN,
  type Zero,
  zerosText,
} from "./choice";
import { plotsOf } from "./curves";
import { Legend, NotShown } from "./Legend";
import classes from "./Overlay.module.css";
import { OverlayPlot } from "./OverlayPlot";

const WIDTH_STEP_PX = 100;

/** Recordings laid over each other, each by its own zero: what do their trips have in common? */
export function OverlayTab() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const { ref, width } = useElementSize();
  const [hoverMs, setHover] = useState<number | null>(null);
  const zeros = useMemo(() => parseZeros(search.overlay ?? ""), [search.overlay]);
  const curves = useMemo(
    () => (search.curves === undefined ? USUAL_CURVES : parseCurves(search.curves)),
    [search.curves],
  );
  const span = useMemo(() => parseSpan(search.window ?? "") ?? USUAL_SPAN, [search.window]);
  const stepped = Math.ceil(Math.max(width, 1) / WIDTH_STEP_PX) * WIDTH_STEP_PX;
  const files = useQuery(recordingsQuery).data?.files;
  const there = useMemo(() => {
    const names = new Set(files?.map(({ name }) => name));
    return files ? zeros.filter(({ name }) => names.has(fileOf(name))) : [];
  }, [files, zeros]);
  const aligned = useQuery(alignQuery(requestOf(there, curves, span, stepped)));
  const shown = useMemo(() => (there.length === 0 ? [] : (aligned.data ?? [])), [there, aligned.data]);
  const plots = useMemo(() => plotsOf(shown), [shown]);
  const choose = (next: readonly Zero[]) => update({ overlay: zerosText(next) || undefined });
  return (
    <div className={classes.tab} data-testid="overlay">
      <Chooser zeros={zeros} onChange={choose} />
      <section className={classes.main} aria-label={t("page.overlay.plots")}>
        <CurveTools
          curves={curves}
          span={span}
          onCurves={(next: readonly Curve[]) => update({ curves: curvesText(next) })}
          onSpan={(next: Span) => update({ window: spanText(next) })}
        />
        {aligned.isError && <ProblemAlert error={aligned.error} title={t("page.overlay.failed")} />}
        <NotShown recordings={shown} gone={files ? zeros.filter((one) => !there.includes(one)) : []} />
        <div className={classes.plots} ref={ref}>
          {zeros.length === 0 && <p className={classes.empty}>{t("page.overlay.empty")}</p>}
          {there.length > 0 && aligned.isPending && <p className={classes.empty}>{t("page.loading")}</p>}
          {aligned.isSuccess && there.length > 0 && plots.length === 0 && (
            <p className={classes.empty}>{t("page.overlay.no_curves")}</p>
          )}
          {plots.map((plot) => (
            <OverlayPlot
              key={plot.address}
              plot={plot}
              span={span}
              width={width}
              hoverMs={hoverMs}
              onHover={setHover}
            />
          ))}
        </div>
        <Legend recordings={shown} plots={plots} hoverMs={hoverMs} />
      </section>
    </div>
  );
}
