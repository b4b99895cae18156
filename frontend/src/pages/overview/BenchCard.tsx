import { IconAlertOctagon, IconAlertTriangle, IconArrowRight } from "@tabler/icons-react";
import { Link } from "@tanstack/react-router";
import type { DeviceRef, ErrorDoc, StationRef } from "../../api/types";
import { type PageSearch, roomSearch } from "../../frame/search";
import { useNodes, useServerNow, useWatchDevice } from "../../live/live";
import { axisStateKey, severityOf } from "../../model/axisState";
import type { DeviceContext } from "../../model/shown";
import { useTexts } from "../../texts/texts";
import { stationName } from "../../ui/devices";
import { age, errorCode } from "../../ui/format";
import { useDeviceTrace } from "../../ui/deviceTrace";
import { ReadingText } from "../../ui/ReadingText";
import { useDeviceContext, useReading } from "../../ui/reading";
import { ERROR_CODE, measuredOf, positionOf, STATUSWORD } from "./bench";
import { Fact } from "./BladeFacts";
import { Heard, heartbeatOf } from "./nodes";
import classes from "./Overview.module.css";

const REFRESH_MS = 250;
const DASH = "–";

/** A station without a blade: of each device where its axis stands, its state, and what it measures. */
export function BenchCard({ station }: { station: StationRef }) {
  const t = useTexts();
  const name = stationName(station, t);
  return (
    <article
      className={`${classes.card} ${classes.bench}`}
      aria-label={name}
      data-testid={`station-${station.slug}`}
    >
      <h2>{name}</h2>
      {station.devices.map((device) => (
        <Device key={device.slug} device={device} />
      ))}
    </article>
  );
}

function Device({ device }: { device: DeviceRef }) {
  const t = useTexts();
  useWatchDevice(device.slug);
  const context = useDeviceContext(device);
  useDeviceTrace(context);
  const position = context && positionOf(context.doc);
  return (
    <section className={classes.benchDevice} aria-label={device.name}>
      <h3>
        {device.name}
        {position !== null && (
          <Link to="/axis" search={(before: PageSearch) => roomSearch(before)} className={classes.toAxis}>
            {t("page.rooms.axis")} <IconArrowRight size={15} aria-hidden />
          </Link>
        )}
      </h3>
      <div className={`${classes.body} bench`}>
        {context && position !== null && <Position context={context} address={position} />}
        {context && position !== null && <State context={context} />}
        <dl className={classes.facts}>
          <Heartbeat device={device} />
          {context && position !== null && (
            <Fact name={t("page.bench.statusword")}>
              <ReadingText context={context} address={STATUSWORD} pace="fast" />
            </Fact>
          )}
          {context &&
            measuredOf(context.doc).map(({ entry, pace }) => (
              <Fact key={entry.address} name={t.nameOf(entry.kind === "var" ? entry.title : entry.name)}>
                <ReadingText context={context} address={entry.address} pace={pace} />
              </Fact>
            ))}
        </dl>
      </div>
    </section>
  );
}

function Position({ context, address }: { context: DeviceContext; address: string }) {
  const t = useTexts();
  const reading = useReading(context, address, "fast");
  const stale = reading?.stale ?? true;
  return (
    <div className={classes.angle}>
      <div className={classes.big} data-stale={stale} data-testid="position">
        {reading === null ? (
          DASH
        ) : reading.unit === "°" ? (
          `${reading.text}°`
        ) : (
          <>
            {reading.text} <small>{reading.unit}</small>
          </>
        )}
      </div>
      {reading !== null && stale && (
        <span className="tone-warning">{t("page.stale", { age: age(reading.ageMs, t.language) })}</span>
      )}
    </div>
  );
}

function State({ context }: { context: DeviceContext }) {
  const t = useTexts();
  const status = useReading(context, STATUSWORD, "fast");
  const complaint = useReading(context, ERROR_CODE, "slow");
  const word = typeof status?.raw === "number" ? status.raw : null;
  const key = word === null ? null : axisStateKey(word);
  const code = typeof complaint?.raw === "number" ? complaint.raw : null;
  return (
    <>
      <div className={classes.state} data-testid="state" data-stale={status?.stale ?? true}>
        {key === null ? DASH : t(key)}
      </div>
      <div className={classes.faults} data-testid="fault">
        {code === null || code === 0 ? (
          <span className="dim">{t(code === 0 ? "page.card.no_fault" : "page.card.fault_unknown")}</span>
        ) : (
          <Complaint
            code={code}
            known={context.doc.errors.find((one) => one.code === code)}
            severity={severityOf(word)}
          />
        )}
      </div>
    </>
  );
}

function Complaint({
  code,
  known,
  severity,
}: {
  code: number;
  known: ErrorDoc | undefined;
  severity: "warning" | "error";
}) {
  const t = useTexts();
  const Icon = severity === "error" ? IconAlertOctagon : IconAlertTriangle;
  return (
    <div className={classes.fault} data-severity={severity}>
      <Icon size={17} aria-hidden />
      <span>
        <span className="visually-hidden">{t(`page.severity.${severity}`)} </span>
        <strong>{errorCode(code)}</strong>{" "}
        {known ? t(known.text_key, { number: known.number }) : t("page.card.unknown_code")}
      </span>
    </div>
  );
}

const HEARD_TONES = { [Heard.Never]: "dim", [Heard.Alive]: "", [Heard.Overdue]: "tone-error" };

/** What tells that the device is there: its heartbeat, or its latest answer where the bus has none. */
function Heartbeat({ device }: { device: DeviceRef }) {
  const t = useTexts();
  const node = useNodes().get(device.slug);
  const { heard, ageMs } = heartbeatOf(node, useServerNow(REFRESH_MS));
  const managed = node?.managed ?? true;
  const words = managed
    ? t(`page.nmt.${(node?.nmt ?? "unknown").replace("-", "_")}`)
    : t(`page.bench.${heard}`);
  return (
    <Fact name={t("page.bench.link")}>
      <span className={managed ? classes.nmt : ""} data-nmt={node?.nmt ?? "unknown"}>
        {words}
      </span>
      <span
        className={HEARD_TONES[heard]}
        title={t(managed ? "page.card.heartbeat" : "page.bench.answer_title")}
        data-testid="heard"
      >
        {ageMs === null ? DASH : managed ? `♥ ${age(ageMs, t.language)}` : age(ageMs, t.language)}
      </span>
    </Fact>
  );
}
