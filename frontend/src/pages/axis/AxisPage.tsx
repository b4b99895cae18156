import type { AxisData, StationRef } from "../../api/types";
import { usePageSearch } from "../../frame/search";
import { useAxes, useServerNow, useWatchDevice } from "../../live/live";
import { figure } from "../../model/values";
import { useTexts } from "../../texts/texts";
import { entriesOf, useDeviceContext, useReading } from "../../ui/reading";
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
  const t = useTexts();
  const axis = useAxes().get(station.blade ?? 0);
  const context = useDeviceContext(axisOf(station));
  const { position, state, stale, ageMs } = useAxisNow(station, context);
  const { unit, decimals } = measuresOf(context).position;
  const ofBlade = station.blade !== null;
  const suffix = ofBlade || unit === "°" ? "°" : ` ${unit}`;
  return (
    <div className={`${classes.now} bench`} data-stale={stale}>
      <strong data-testid="axis-angle">
        {position === null ? "–" : `${figure(position, ofBlade ? 2 : decimals, t.language)}${suffix}`}
      </strong>
      <span data-testid="axis-state">{state === null ? "–" : t(state)}</span>
      {stale && axis?.position_t_ns != null && <Age axis={axis} />}
      {stale && ageMs !== null && (
        <span className="tone-warning">{t("page.stale", { age: age(ageMs, t.language) })}</span>
      )}
    </div>
  );
}

/** The device with the controlword; at a station with several the first. */
const axisOf = (station: StationRef) => station.devices.find((device) => device.axis);

function Age({ axis }: { axis: AxisData }) {
  const t = useTexts();
  const nowMs = useServerNow(500);
  const ageMs = nowMs - (axis.position_t_ns ?? 0) / 1e6;
  return <span className="tone-warning">{t("page.stale", { age: age(ageMs, t.language) })}</span>;
}

function Axis({ station }: { station: StationRef }) {
  const t = useTexts();
  const pmm = station.devices.find((device) => device.description_id === PMM);
  const drive = axisOf(station);
  useWatchDevice(pmm?.slug ?? null);
  useWatchDevice(drive?.slug ?? null);
  const contexts = { pmm: useDeviceContext(pmm), pmc: useDeviceContext(drive) };
  const now = useAxisNow(station, contexts.pmc);
  const blade = useAxes().get(station.blade ?? 0);
  const faults = useFaults(contexts.pmc, blade?.faults);
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
        <StateDiagram doc={contexts.pmc?.doc ?? null} state={now.state} stale={now.stale} />
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

/** Those of a blade come with it; of another axis its error code and its statusword tell. */
function useFaults(
  context: DeviceContext | null,
  ofBlade: AxisData["faults"] | undefined,
): AxisData["faults"] {
  const objects = objectsOf(context?.doc);
  const reading = useReading(context, objects.errorCode, "slow");
  const status = useReading(context, objects.statusword, "fast");
  if (ofBlade !== undefined || context === null) return ofBlade ?? [];
  const code = reading?.raw;
  if (typeof code !== "number" || code === 0) return [];
  const word = typeof status?.raw === "number" ? status.raw : null;
  const severity = context.doc.state_machine ? "error" : severityOf(word);
  return [{ device: context.slug, code, text_key: errorIn(context.doc, code)?.text_key ?? null, severity }];
}
