import { Button, SegmentedControl } from "@mantine/core";
import {
  IconDownload,
  IconLayoutRows,
  IconPhoto,
  IconRulerMeasure,
  IconZoomIn,
  IconZoomOut,
  IconZoomReset,
} from "@tabler/icons-react";
import { useDebouncedValue } from "@mantine/hooks";
import { useQueries, useQuery } from "@tanstack/react-query";
import { useMemo, useRef, useState } from "react";
import type UPlot from "uplot";
import {
  type Capture,
  type CaptureLine,
  captureQuery,
  csvOfCapture,
  jsonOfCapture,
  type CaptureHead,
  seriesQuery,
} from "../../../api/scope";
import { usePageSearch } from "../../../frame/search";
import { spanAt } from "../../../model/tracks";
import { localise } from "../../../model/values";
import { type Translate, useTexts } from "../../../texts/texts";
import { useDeviceName } from "../../../ui/devices";
import { dayAndTime } from "../../../ui/format";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { CaptureFacts, CaptureTitle } from "./CaptureFacts";
import { InForce } from "./InForce";
import { Measure } from "./Measure";
import { headingOf, pictureOf, savePicture } from "./png";
import classes from "./Scope.module.css";
import { ScopePlots } from "./ScopePlots";
import { SpectrumView } from "./SpectrumView";
import {
  EACH,
  groupsOf,
  referenceTraces,
  numberText,
  secondsText,
  spanText,
  type Trace,
  tracesOf,
  valueAt,
} from "./traces";
import { listOf, type Pair, pairText, parsePair, within, zoomed, zoomOf } from "./view";
import { XyView } from "./XyView";

const POINTS = 2000;
const SETTLES_MS = 150;
const ZOOM = 0.5;
const VIEWS = ["time", "fft", "xy"] as const;

interface Props {
  id: string;
  captures: readonly CaptureLine[];
  armed: boolean;
}

/** One capture that is kept: its plots, measurements, spectrum, and the parameters that were in force. */
export function CaptureView({ id, captures, armed }: Props) {
  const t = useTexts();
  const { data, error } = useQuery(captureQuery(id));
  if (error) return <ProblemAlert error={error} title={t("page.scope.view_failed")} />;
  return data ? <Shown capture={data} captures={captures} armed={armed} /> : null;
}

const wholeOf = (head: CaptureHead): Pair => [
  (head.start_ns - head.trigger_ns) / 1e9,
  (head.end_ns - head.trigger_ns) / 1e9,
];

function Shown({ capture, captures, armed }: Omit<Props, "id"> & { capture: Capture }) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const { head } = capture;
  const page = useRef<HTMLDivElement>(null);
  const whole = useMemo(() => wholeOf(head), [head]);
  const view = useMemo(() => zoomOf(search.zoom, whole), [search.zoom, whole]);
  const cursors = useMemo(() => parsePair(search.cursors), [search.cursors]);
  const [hoverS, setHoverS] = useState<number | null>(null);
  const [drawn] = useState(() => new Map<string, UPlot>());
  const traces = useTraces(head, captures, view, search.zoom !== undefined);
  const each = search.axes === EACH;
  const groups = useMemo(() => groupsOf(traces, each), [traces, each]);
  const own = useMemo(() => traces.filter((one) => one.reference === null), [traces]);
  const marks = useMemo(
    () => head.marks.map((one) => ({ atS: (one.t_ns - head.trigger_ns) / 1e9, what: one.what })),
    [head],
  );
  const show = (next: Pair | null) => update({ zoom: next === null ? undefined : pairText(next) });
  const measure = VIEWS.find((one) => one === search.measure) ?? "time";
  const save = () => {
    const picture = {
      title: head.name,
      about: aboutText(head, t),
      plots: [...drawn].map(([key, made]) => {
        const group = groups.find((one) => one.key === key);
        return { made, heading: group ? headingOf(group, t("page.scope.plot_bits")) : key.toUpperCase() };
      }),
      legend: traces.map((trace) => ({ trace, text: legendOf(trace, cursors, t) })),
      axis: measure === "time" ? t("page.scope.time_axis") : "",
      between: measure === "time" && cursors ? betweenText(cursors, t) : "",
      view,
      cursors: measure === "time" ? cursors : null,
    };
    const canvas = page.current && pictureOf(picture, page.current);
    if (canvas) savePicture(canvas, `scope-${head.turbine}-${head.name.replaceAll(/[^\w-]+/g, "-")}.png`);
  };
  return (
    <div ref={page} className={classes.shown} data-testid="scope-capture">
      <div className={classes.toolbar} role="toolbar" aria-label={t("page.scope.view_label")}>
        {armed && (
          <Button variant="default" onClick={() => update({ capture: undefined })} data-testid="show-live">
            {t("page.scope.live")}
          </Button>
        )}
        <SegmentedControl
          value={measure}
          onChange={(next) => update({ measure: next === "time" ? undefined : next })}
          data={VIEWS.map((one) => ({ value: one, label: t(`page.scope.view_${one}`) }))}
          aria-label={t("page.scope.view_label")}
          data-testid="scope-view"
        />
        <Button
          variant={cursors ? "light" : "default"}
          leftSection={<IconRulerMeasure size={17} aria-hidden />}
          aria-pressed={cursors !== null}
          onClick={() => update({ cursors: cursors ? undefined : pairText(thirds(view)) })}
          data-testid="cursors"
        >
          {t("page.scope.cursors")}
        </Button>
        <Zoom view={view} whole={whole} onView={show} />
        <Button
          variant={each ? "light" : "default"}
          px={10}
          aria-pressed={each}
          aria-label={t("page.scope.axes_each")}
          title={t("page.scope.axes_each")}
          onClick={() => update({ axes: each ? undefined : EACH })}
          data-testid="axes-each"
        >
          <IconLayoutRows size={18} aria-hidden />
        </Button>
        <span className={classes.spacer} />
        <Button
          component="a"
          variant="default"
          leftSection={<IconDownload size={17} aria-hidden />}
          href={csvOfCapture(head.id, t.language)}
          download
          data-testid="scope-csv"
        >
          {t("page.scope.csv")}
        </Button>
        <Button
          component="a"
          variant="default"
          leftSection={<IconDownload size={17} aria-hidden />}
          href={jsonOfCapture(head.id)}
          download
          data-testid="scope-json"
        >
          {t("page.scope.json")}
        </Button>
        <Button
          variant="default"
          leftSection={<IconPhoto size={17} aria-hidden />}
          onClick={save}
          data-testid="scope-png"
        >
          {t("page.scope.png")}
        </Button>
      </div>
      <CaptureTitle capture={capture} />
      {measure === "time" && (
        <>
          <ScopePlots
            groups={groups}
            whole={whole}
            view={view}
            endS={whole[1]}
            marks={marks}
            cursors={cursors}
            still
            hoverS={hoverS}
            onHover={setHoverS}
            onView={show}
            onCursors={(next) => update({ cursors: pairText(next) })}
            drawn={drawn}
          />
          <Measure
            traces={traces}
            cursors={cursors}
            hoverS={hoverS}
            onCursors={(next) => update({ cursors: pairText(next) })}
          />
        </>
      )}
      {measure === "fft" && <SpectrumView {...{ head, view, cursors, drawn }} traces={own} />}
      {measure === "xy" && <XyView {...{ head, view, cursors, drawn }} traces={own} />}
      <CaptureFacts capture={capture} />
      <InForce head={head} />
    </div>
  );
}

/** The signals of a capture in view, and of those that are laid over it. */
function useTraces(
  head: CaptureHead,
  captures: readonly CaptureLine[],
  view: Pair,
  isZoomed: boolean,
): Trace[] {
  const t = useTexts();
  const deviceName = useDeviceName();
  const [search] = usePageSearch();
  const settled = useSettled(view);
  const span = isZoomed ? settled : null;
  const values = useQuery(seriesQuery(head.id, span, POINTS)).data;
  const ids = useMemo(() => listOf(search.refs).filter((one) => one !== head.id), [search.refs, head.id]);
  const laid = useQueries({
    queries: ids.map((id) => seriesQuery(id, settled, POINTS)),
    combine: (results) => results.map((one) => one.data),
  });
  return useMemo(() => {
    if (!values) return [];
    const own = tracesOf(head.signals, values, deviceName, t);
    const over = ids.flatMap((id, at) => {
      const name = captures.find((one) => one.id === id)?.name ?? id;
      const series = laid[at];
      return series ? referenceTraces(own, series, name, at) : [];
    });
    return [...own, ...over];
  }, [values, head.signals, deviceName, t, ids, laid, captures]);
}

/** The view once it stands: a drag is not a request for every pixel. */
function useSettled([fromS, toS]: Pair): Pair {
  const [from] = useDebouncedValue(fromS, SETTLES_MS);
  const [to] = useDebouncedValue(toS, SETTLES_MS);
  return useMemo(() => [from, to], [from, to]);
}

const thirds = (view: Pair): Pair => [
  view[0] + (view[1] - view[0]) / 3,
  view[0] + (2 * (view[1] - view[0])) / 3,
];

function legendOf(trace: Trace, cursors: Pair | null, t: ReturnType<typeof useTexts>): string {
  const unit = trace.unit === "" ? "" : ` ${trace.unit}`;
  const note =
    trace.reference === null ? "" : `, ${t("page.scope.reference_note", { name: trace.reference })}`;
  const name = `${trace.label}${trace.unit === "" ? "" : ` [${trace.unit}]`}${note}`;
  if (!cursors) return name;
  const [a, b] = cursors.map((atS) => `${spanText(spanAt(trace.track, atS), trace, t)}${unit}`);
  const [atA, atB] = cursors.map((atS) => valueAt(trace, atS) ?? NaN);
  const difference = (atB ?? NaN) - (atA ?? NaN);
  const delta = Number.isNaN(difference) ? "–" : `${numberText(difference, trace.decimals, t)}${unit}`;
  return `${name}   A ${a ?? "–"}   B ${b ?? "–"}   Δ ${delta}`;
}

function aboutText(head: CaptureHead, t: Translate): string {
  const facts = [
    head.turbine_name,
    dayAndTime(head.trigger_ns / 1e6),
    head.person,
    t(`page.scope.cause_${head.cause}`),
  ];
  return [...facts, ...(head.twin ? [t("page.scope.twin")] : [])].join(", ");
}

function betweenText([a, b]: Pair, t: Translate): string {
  const frequency = a === b ? "–" : `${localise((1 / Math.abs(b - a)).toPrecision(4), t.language)} Hz`;
  const times = `A ${secondsText(a, t, 6)} s   B ${secondsText(b, t, 6)} s   Δt ${secondsText(b - a, t, 6)} s`;
  return `${times}   1/Δt ${frequency}`;
}

function Zoom({ view, whole, onView }: { view: Pair; whole: Pair; onView: (view: Pair | null) => void }) {
  const t = useTexts();
  const middleS = (view[0] + view[1]) / 2;
  const buttons = [
    { key: "zoom_in", icon: <IconZoomIn size={18} />, run: () => onView(zoomed(view, whole, ZOOM, middleS)) },
    {
      key: "zoom_out",
      icon: <IconZoomOut size={18} />,
      run: () => onView(zoomed(view, whole, 1 / ZOOM, middleS)),
    },
    { key: "zoom_reset", icon: <IconZoomReset size={18} />, run: () => onView(null) },
  ];
  const all = within(view, whole) === null;
  return (
    <Button.Group>
      {buttons.map(({ key, icon, run }) => (
        <Button
          key={key}
          variant="default"
          px={10}
          aria-label={t(`page.scope.${key}`)}
          title={t(`page.scope.${key}`)}
          disabled={all && key !== "zoom_in"}
          onClick={run}
          data-testid={key}
        >
          {icon}
        </Button>
      ))}
    </Button.Group>
  );
}
