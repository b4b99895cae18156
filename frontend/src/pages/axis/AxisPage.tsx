import type { AxisData, StationRef } from "../../api/types";
import { usePageSearch } from "../../frame/search";
import { useAxes, useServerNow, useWatchDevice } from "../../live/live";
import { figure } from "../../model/values";
import { useTexts } from "../../texts/texts";
import { useDeviceContext } from "../../ui/reading";
import { age } from "../../ui/format";
import { PMC, PMM } from "../overview/layout";
import classes from "./Axis.module.css";
import { BladeStrip } from "./BladeStrip";
import { BitPanel } from "./BitPanel";
import { ErrorHistory } from "./ErrorHistory";
import { Measurements } from "./Measurements";
import { MotionPanel } from "./MotionPanel";
import { Plots } from "./Plots";
import { RecordedNote } from "./RecordedNote";
import { StateDiagram } from "./StateDiagram";

/** One axis in full: its state machine, what it measures, its inputs and outputs, and what moves it. */
export function AxisPage() {
  return (
    <div className={classes.page}>
      <BladeStrip now={(station) => <Now station={station} />}>
        {(station) => <Blade key={station.slug} station={station} />}
      </BladeStrip>
    </div>
  );
}

function Now({ station }: { station: StationRef }) {
  const t = useTexts();
  const axis = useAxes().get(station.blade ?? 0);
  const stale = axis?.stale ?? true;
  return (
    <div className={`${classes.now} bench`} data-stale={stale}>
      <strong data-testid="axis-angle">
        {axis?.position_deg == null ? "–" : `${figure(axis.position_deg, 2, t.language)}°`}
      </strong>
      <span data-testid="axis-state">{axis?.state == null ? "–" : t(axis.state)}</span>
      {stale && axis?.position_t_ns != null && <Age axis={axis} />}
    </div>
  );
}

function Age({ axis }: { axis: AxisData }) {
  const t = useTexts();
  const nowMs = useServerNow(500);
  const ageMs = nowMs - (axis.position_t_ns ?? 0) / 1e6;
  return <span className="tone-warning">{t("page.stale", { age: age(ageMs, t.language) })}</span>;
}

function Blade({ station }: { station: StationRef }) {
  const t = useTexts();
  const pmm = station.devices.find((device) => device.description_id === PMM);
  const pmc = station.devices.find((device) => device.description_id === PMC);
  useWatchDevice(pmm?.slug ?? null);
  useWatchDevice(pmc?.slug ?? null);
  const contexts = { pmm: useDeviceContext(pmm), pmc: useDeviceContext(pmc) };
  const axis = useAxes().get(station.blade ?? 0);
  const [{ replay }] = usePageSearch();
  return (
    <div className={`${classes.panels} bench`}>
      {replay !== undefined ? (
        <RecordedNote part="motion" />
      ) : (
        pmc && <MotionPanel device={pmc} context={contexts.pmc} />
      )}
      <section className={`${classes.panel} ${classes.plots}`} aria-label={t("page.axis.machine")}>
        <h2>{t("page.axis.machine")}</h2>
        <StateDiagram state={axis?.state ?? null} stale={axis?.stale ?? true} />
      </section>
      <section className={`${classes.panel} ${classes.plots}`} aria-label={t("page.axis.plots")}>
        <Plots blade={station.blade ?? 0} />
      </section>
      <Measurements {...contexts} />
      <BitPanel title={t("page.axis.statusword")} context={contexts.pmc} address="6041" pace="fast" />
      <BitPanel title={t("page.axis.controlword")} context={contexts.pmc} address="6040" pace="rare" />
      <BitPanel
        title={t("page.axis.inputs", { device: "PMC" })}
        context={contexts.pmc}
        address="60FD"
        pace="slow"
      />
      <BitPanel
        title={t("page.axis.outputs", { device: "PMC" })}
        context={contexts.pmc}
        address="60FE:03"
        pace="slow"
      />
      <BitPanel
        title={t("page.axis.inputs", { device: "PMM" })}
        context={contexts.pmm}
        address="30FD"
        pace="slow"
      />
      <BitPanel
        title={t("page.axis.outputs", { device: "PMM" })}
        context={contexts.pmm}
        address="30FE:03"
        pace="slow"
      />
      <ErrorHistory device={pmc} context={contexts.pmc} partner={contexts.pmm} faults={axis?.faults ?? []} />
      <ErrorHistory device={pmm} context={contexts.pmm} partner={contexts.pmc} faults={axis?.faults ?? []} />
    </div>
  );
}
