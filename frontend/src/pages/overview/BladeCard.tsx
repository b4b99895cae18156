import { IconAlertOctagon } from "@tabler/icons-react";
import { lazy, Suspense } from "react";
import type { AxisData, DeviceRef, StationRef } from "../../api/types";
import { useAxes, useNodes, useServerNow } from "../../live/live";
import { followsDemand } from "../../live/axis";
import { figure } from "../../model/values";
import { useTexts } from "../../texts/texts";
import { stationName } from "../../ui/devices";
import { age, errorCode } from "../../ui/format";
import { Heard, heartbeatOf } from "./nodes";
import classes from "./Overview.module.css";

const AngleTrace = lazy(() => import("./AngleTrace").then((module) => ({ default: module.AngleTrace })));

const REFRESH_MS = 250;
const DASH = "–";

export function BladeCard({ station }: { station: StationRef }) {
  const t = useTexts();
  const blade = station.blade ?? 0;
  const axis = useAxes().get(blade);
  const name = stationName(station, t);
  return (
    <article
      className={classes.card}
      aria-label={name}
      data-testid={`blade-${blade}`}
      data-stale={axis?.stale ?? true}
    >
      <h2>{name}</h2>
      <div className={`${classes.body} bench`}>
        <Angle axis={axis} />
        <DriveState axis={axis} />
        <dl className={classes.facts}>
          {station.devices.map((device) => (
            <NodeLine key={device.slug} device={device} />
          ))}
          <Fact name={t("page.card.battery")}>
            <Figure number={axis?.battery_soc_pct} decimals={0} unit="%" stale={axis?.stale} />
            <Figure number={axis?.battery_v} decimals={1} unit="V" stale={axis?.stale} />
          </Fact>
          <Fact name={t("page.card.dc_link")}>
            <span />
            <Figure number={axis?.dc_link_v} decimals={1} unit="V" stale={axis?.stale} />
          </Fact>
        </dl>
        <Suspense fallback={<div className={classes.trace} />}>
          <AngleTrace blade={blade} label={t("page.card.trace", { blade: name })} />
        </Suspense>
      </div>
    </article>
  );
}

function Angle({ axis }: { axis: AxisData | undefined }) {
  const t = useTexts();
  const stale = axis?.stale ?? true;
  return (
    <div className={classes.angle}>
      <div className={classes.big} data-stale={stale} data-testid="angle">
        {axis?.position_deg == null ? DASH : `${figure(axis.position_deg, 2, t.language)}°`}
      </div>
      <div className={classes.demand}>
        {stale && axis?.position_t_ns != null ? (
          <Age sinceMs={axis.position_t_ns / 1e6} />
        ) : (
          <>
            <span className="dim">{t("page.card.demand")}</span>
            <span data-testid="demand" data-stale={!axis || !followsDemand(axis)} className={classes.figure}>
              {axis?.demand_deg == null ? DASH : `${figure(axis.demand_deg, 2, t.language)}°`}
            </span>
          </>
        )}
      </div>
    </div>
  );
}

function Age({ sinceMs }: { sinceMs: number }) {
  const t = useTexts();
  const nowMs = useServerNow(REFRESH_MS);
  return <span className="tone-warning">{t("page.stale", { age: age(nowMs - sinceMs, t.language) })}</span>;
}

function DriveState({ axis }: { axis: AxisData | undefined }) {
  const t = useTexts();
  const fault = axis?.fault_code != null && axis.fault_code !== 0 ? axis.fault_code : null;
  return (
    <>
      <div className={classes.state} data-testid="state" data-stale={axis?.stale ?? true}>
        {axis?.state == null ? DASH : t(axis.state)}
      </div>
      <div className={classes.fault} data-fault={fault !== null} data-testid="fault">
        {fault === null ? (
          <span className="dim">
            {t(axis?.fault_code === 0 ? "page.card.no_fault" : "page.card.fault_unknown")}
          </span>
        ) : (
          <>
            <IconAlertOctagon size={17} aria-hidden />
            <span>
              <strong>{errorCode(fault)}</strong> {axis?.fault_text_key == null ? "" : t(axis.fault_text_key)}
            </span>
          </>
        )}
      </div>
    </>
  );
}

const HEARD_TONES = { [Heard.Never]: "dim", [Heard.Alive]: "", [Heard.Overdue]: "tone-error" };

function NodeLine({ device }: { device: DeviceRef }) {
  const t = useTexts();
  const node = useNodes().get(device.slug);
  const { heard, ageMs } = heartbeatOf(node, useServerNow(REFRESH_MS));
  return (
    <Fact name={device.name}>
      <span className={classes.nmt} data-nmt={node?.nmt ?? "unknown"}>
        {t(`page.nmt.${(node?.nmt ?? "unknown").replace("-", "_")}`)}
      </span>
      <span className={HEARD_TONES[heard]} title={t("page.card.heartbeat")}>
        {ageMs === null ? t("page.card.no_heartbeat") : `♥ ${age(ageMs, t.language)}`}
      </span>
    </Fact>
  );
}

function Fact({ name, children }: { name: string; children: React.ReactNode }) {
  return (
    <div className={classes.fact}>
      <dt>{name}</dt>
      <dd>{children}</dd>
    </div>
  );
}

interface FigureProps {
  number: number | null | undefined;
  decimals: number;
  unit: string;
  stale: boolean | undefined;
}

function Figure({ number, decimals, unit, stale }: FigureProps) {
  const t = useTexts();
  return (
    <span data-stale={stale ?? true} className={classes.figure}>
      {number == null ? DASH : `${figure(number, decimals, t.language)} ${unit}`}
    </span>
  );
}
