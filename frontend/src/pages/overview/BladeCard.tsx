import { IconAlertOctagon, IconAlertTriangle, IconArrowRight } from "@tabler/icons-react";
import { Link } from "@tanstack/react-router";
import { lazy, Suspense } from "react";
import type { AxisData, DeviceRef, StationRef } from "../../api/types";
import { type PageSearch, roomSearch } from "../../frame/search";
import { followsDemand } from "../../live/axis";
import { useAxis, useDerived, useServerNow, useWatchDevice } from "../../live/live";
import { figure } from "../../model/values";
import { useTexts } from "../../texts/texts";
import { stationName } from "../../ui/devices";
import { age, errorCode } from "../../ui/format";
import { BladeFacts, Fact } from "./BladeFacts";
import { EfcChain } from "./EfcChain";
import { PMC, PMM } from "./layout";
import { Heard, heartbeatOf } from "./nodes";
import classes from "./Overview.module.css";
import { useDeviceContext } from "../../ui/reading";

const AngleTrace = lazy(() => import("./AngleTrace").then((module) => ({ default: module.AngleTrace })));

const REFRESH_MS = 250;
const DASH = "–";

export function BladeCard({ station }: { station: StationRef }) {
  const t = useTexts();
  const blade = station.blade ?? 0;
  const stale = useAxis(blade, (axis) => axis?.stale ?? true);
  const name = stationName(station, t);
  const pmm = station.devices.find((device) => device.description_id === PMM);
  const pmc = station.devices.find((device) => device.description_id === PMC);
  useWatchDevice(pmm?.slug ?? null);
  useWatchDevice(pmc?.slug ?? null);
  const contexts = { pmm: useDeviceContext(pmm), pmc: useDeviceContext(pmc) };
  return (
    <article className={classes.card} aria-label={name} data-testid={`blade-${blade}`} data-stale={stale}>
      <h2>
        {name}
        <Link
          to="/axis"
          search={(before: PageSearch) => roomSearch(before, { blade: String(blade) })}
          className={classes.toAxis}
        >
          {t("page.rooms.axis")} <IconArrowRight size={15} aria-hidden />
        </Link>
      </h2>
      <div className={`${classes.body} bench`}>
        <Angle blade={blade} />
        <DriveState blade={blade} />
        <dl className={classes.facts}>
          {station.devices.map((device) => (
            <NodeLine key={device.slug} device={device} />
          ))}
          <BladeFacts {...contexts} />
          <Fact name={t("page.card.efc_chain")}>
            <EfcChain {...contexts} />
          </Fact>
        </dl>
        <Suspense fallback={<div className={classes.trace} />}>
          <AngleTrace blade={blade} label={t("page.card.trace", { blade: name })} />
        </Suspense>
      </div>
    </article>
  );
}

function Angle({ blade }: { blade: number }) {
  const t = useTexts();
  const words = (deg: number | null | undefined) => (deg == null ? DASH : `${figure(deg, 2, t.language)}°`);
  const { angle, demand, follows, stale, sinceNs } = useAxis(blade, (axis) => ({
    angle: words(axis?.position_deg),
    demand: words(axis?.demand_deg),
    follows: axis !== undefined && followsDemand(axis),
    stale: axis?.stale ?? true,
    sinceNs: axis?.stale ? axis.position_t_ns : null,
  }));
  return (
    <div className={classes.angle}>
      <div className={classes.big} data-stale={stale} data-testid="angle">
        {angle}
      </div>
      <div className={classes.demand}>
        {sinceNs !== null ? (
          <Age sinceMs={sinceNs / 1e6} />
        ) : (
          <>
            <span className="dim">{t("page.card.demand")}</span>
            <span data-testid="demand" data-stale={!follows} className={classes.figure}>
              {demand}
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

function DriveState({ blade }: { blade: number }) {
  const t = useTexts();
  const { state, stale, faults, known } = useAxis(blade, (axis) => ({
    state: axis?.state ?? null,
    stale: axis?.stale ?? true,
    faults: axis?.faults ?? [],
    known: axis?.fault_code === 0,
  }));
  return (
    <>
      <div className={classes.state} data-testid="state" data-stale={stale}>
        {state === null ? DASH : t(state)}
      </div>
      <div className={classes.faults} data-testid="fault">
        {faults.length === 0 && (
          <span className="dim">{t(known ? "page.card.no_fault" : "page.card.fault_unknown")}</span>
        )}
        {faults.map((fault) => (
          <Complaint key={`${fault.device} ${fault.code}`} {...fault} />
        ))}
      </div>
    </>
  );
}

function Complaint({ device, code, text_key, severity }: AxisData["faults"][number]) {
  const t = useTexts();
  const Icon = severity === "error" ? IconAlertOctagon : IconAlertTriangle;
  return (
    <div className={classes.fault} data-severity={severity}>
      <Icon size={17} aria-hidden />
      <span>
        <span className="visually-hidden">{t(`page.severity.${severity}`)} </span>
        {device.split("/").at(-1)?.toUpperCase()} <strong>{errorCode(code)}</strong>{" "}
        {text_key === null ? t("page.card.unknown_code") : t(text_key)}
      </span>
    </div>
  );
}

const HEARD_TONES = { [Heard.Never]: "dim", [Heard.Alive]: "", [Heard.Overdue]: "tone-error" };

function NodeLine({ device }: { device: DeviceRef }) {
  const t = useTexts();
  const { nmt, heard, words } = useDerived(
    ["nodes"],
    (store) => {
      const node = store.nodes.get(device.slug);
      const { heard, ageMs } = heartbeatOf(node, store.serverNowMs());
      const words = ageMs === null ? t("page.card.no_heartbeat") : `♥ ${age(ageMs, t.language)}`;
      return { nmt: node?.nmt ?? "unknown", heard, words };
    },
    { everyMs: REFRESH_MS },
  );
  return (
    <Fact name={device.name}>
      <span className={classes.nmt} data-nmt={nmt}>
        {t(`page.nmt.${nmt.replace("-", "_")}`)}
      </span>
      <span className={HEARD_TONES[heard]} title={t("page.card.heartbeat")}>
        {words}
      </span>
    </Fact>
  );
}
