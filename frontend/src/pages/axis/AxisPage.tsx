import type { AxisData, StationRef } from "../../api/types";
import { usePageSearch } from "../../frame/search";
import { useAxis, useDerived, useServerNow, useWatchDevice } from "../../live/live";
import { figure } from "../../model/values";
import { useTexts } from "../../texts/texts";
import { entriesOf, useDeviceContext } from "../../ui/reading";
import { measuresOf, useAxisNow } from "../../motion/axis";
import { severityOf } from "../../model/axisState";
import type { DeviceContext } from "../../model/shown";
import { objectsOf } from "../../model/stateMachine";
import { errorIn } from "./errorMemory";
import { Routing } from "./Routing";
import { age } from "../../ui/format";
import { PMM } from "../overview/layout";
import classes from "./Axis.module.css";
import { BladeStrip } from "./BladeStrip";
import { BitPanel } from "./BitPanel";
import { ErrorHistory } from "./ErrorHistory";
import { Measurements } from "./Measurements";
import { MotionPanel } from "./MotionPanel";
import { BladePlots, DevicePlots } from "./Plots";
import { RecordedNote } from "./RecordedNote";
import { StateDiagram } from "./StateDiagram";

/** One axis in full: its state machine, what it measures, its inputs and outputs, and what moves it. */
export function AxisPage() {
  return (
    <div className={classes.page}>
      <BladeStrip now={(station) => <Now station={station} />} benches>
        {(station) => <Axis key={station.slug} station={station} />}
      </BladeStrip>
    </div>
  );
}

function Now({ station }: { station: StationRef }) {
  const context = useDeviceContext(axisOf(station));
  const stale = useAxisNow(station, context, (now) => now.stale);
  return (
    <div className={`${classes.now} bench`} data-stale={stale}>
      <NowAt station={station} context={context} />
      <NowIn station={station} context={context} />
      {stale && <NowSince station={station} context={context} />}
    </div>
  );
}

interface NowProps {
  station: StationRef;
  context: DeviceContext | null;
}

function NowAt({ station, context }: NowProps) {
  const t = useTexts();
  const ofBlade = station.blade !== null;
  const words = useAxisNow(station, context, ({ position }) => {
    if (position === null) return "–";
    const { unit, decimals } = measuresOf(context).position;
    const suffix = ofBlade || unit === "°" ? "°" : ` ${unit}`;
    return `${figure(position, ofBlade ? 2 : decimals, t.language)}${suffix}`;
  });
  return <strong data-testid="axis-angle">{words}</strong>;
}

function NowIn({ station, context }: NowProps) {
  const t = useTexts();
  const state = useAxisNow(station, context, (now) => now.state);
  return <span data-testid="axis-state">{state === null ? "–" : t(state)}</span>;
}

/** How old is what is shown. */
function NowSince({ station, context }: NowProps) {
  const t = useTexts();
  const ofDevice = useAxisNow(station, context, ({ ageMs }) => ageMs);
  const sinceNs = useAxis(station.blade ?? 0, (axis) => axis?.position_t_ns ?? null);
  const nowMs = useServerNow(500);
  const ageMs = ofDevice ?? (sinceNs === null ? null : nowMs - sinceNs / 1e6);
  if (ageMs === null) return null;
  return <span className="tone-warning">{t("page.stale", { age: age(ageMs, t.language) })}</span>;
}

/** The device with the controlword; at a station with several the first. */
const axisOf = (station: StationRef) => station.devices.find((device) => device.axis);

function Axis({ station }: { station: StationRef }) {
  const t = useTexts();
  const pmm = station.devices.find((device) => device.description_id === PMM);
  const drive = axisOf(station);
  useWatchDevice(pmm?.slug ?? null);
  useWatchDevice(drive?.slug ?? null);
  const contexts = { pmm: useDeviceContext(pmm), pmc: useDeviceContext(drive) };
  const faults = useFaults(station, contexts.pmc);
  const [{ replay }] = usePageSearch();
  const name = drive?.name.toUpperCase() ?? "";
  const objects = objectsOf(contexts.pmc?.doc);
  return (
    <div className={`${classes.panels} bench`}>
      {replay !== undefined ? (
        <RecordedNote part="motion" />
      ) : (
        drive && <MotionPanel station={station} device={drive} context={contexts.pmc} />
      )}
      <section className={`${classes.panel} ${classes.plots}`} aria-label={t("page.axis.machine")}>
        <h2>{t("page.axis.machine")}</h2>
        <StateNow station={station} context={contexts.pmc} />
      </section>
      <section className={`${classes.panel} ${classes.plots}`} aria-label={t("page.axis.plots")}>
        {station.blade !== null ? (
          <BladePlots blade={station.blade} />
        ) : (
          contexts.pmc && <DevicePlots context={contexts.pmc} />
        )}
      </section>
      <Measurements {...contexts} />
      <BitPanel
        title={t("page.axis.statusword")}
        context={contexts.pmc}
        address={objects.statusword}
        pace="fast"
      />
      <BitPanel
        title={t("page.axis.controlword")}
        context={contexts.pmc}
        address={objects.controlword}
        pace="rare"
      />
      <BitPanel
        title={t("page.axis.inputs", { device: name })}
        context={contexts.pmc}
        address="60FD"
        pace="slow"
      />
      {/* What the outputs are, where the drive tells it; else what they are told to be. */}
      <BitPanel
        title={t("page.axis.outputs", { device: name })}
        context={contexts.pmc}
        address={contexts.pmc && !entriesOf(contexts.pmc.doc).has("60FE:03") ? "60FE:01" : "60FE:03"}
        pace="slow"
      />
      <Routing context={contexts.pmc} />
      {pmm && (
        <>
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
        </>
      )}
      <ErrorHistory device={drive} context={contexts.pmc} partner={contexts.pmm} faults={faults} />
      <ErrorHistory device={pmm} context={contexts.pmm} partner={contexts.pmc} faults={faults} />
    </div>
  );
}

function StateNow({ station, context }: NowProps) {
  const { state, stale } = useAxisNow(station, context, (now) => ({ state: now.state, stale: now.stale }));
  return <StateDiagram doc={context?.doc ?? null} state={state} stale={stale} />;
}

/** Those of a blade come with it; of another axis its error code and its statusword tell. */
function useFaults(station: StationRef, context: DeviceContext | null): AxisData["faults"] {
  const objects = objectsOf(context?.doc);
  const ofBlade = useAxis(station.blade ?? 0, (axis) => axis?.faults);
  const ofDevice = useDerived(
    context === null
      ? []
      : [objects.errorCode, objects.statusword].map((address) => `value:${context.slug}/${address}`),
    () => (context === null || ofBlade !== undefined ? [] : faultsOf(context)),
  );
  return ofBlade ?? ofDevice;
}

function faultsOf(context: DeviceContext): AxisData["faults"] {
  const { errorCode, statusword } = objectsOf(context.doc);
  const code = context.lookup(errorCode);
  const status = context.lookup(statusword);
  if (typeof code !== "number" || code === 0) return [];
  const word = typeof status === "number" ? status : null;
  const severity = context.doc.state_machine ? "error" : severityOf(word);
  return [{ device: context.slug, code, text_key: errorIn(context.doc, code)?.text_key ?? null, severity }];
}
