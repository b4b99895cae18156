import { Button, CloseButton } from "@mantine/core";
import { type ReactNode } from "react";
import type { TraceLine } from "../../api/trace";
import { usePageSearch } from "../../frame/search";
import { figure } from "../../model/values";
import { useTexts } from "../../texts/texts";
import { useDeviceName } from "../../ui/devices";
import { timeOfDay } from "../../ui/format";
import classes from "./Bus.module.css";
import {
  bytesOf,
  exactTime,
  HEADER_BYTES,
  idText,
  isCan,
  noteTexts,
  objectName,
  partnerOf,
  serviceText,
  shownBytes,
  station,
  valueText,
} from "./lines";
import { partsOf } from "./fdlParts";

interface Props {
  line: TraceLine;
  rows: readonly TraceLine[];
  onPick: (tNs: number | null) => void;
}

/** Everything that is known of one frame, and the frame with which it makes a transfer. */
export function FrameDetail({ line, rows, onPick }: Props) {
  const t = useTexts();
  const nameOf = useDeviceName();
  const previous = rows[rows.indexOf(line) - 1];
  const ms = (ns: number) => figure(ns / 1e6, 3, t.language);
  return (
    <section
      className={`${classes.detail} bench`}
      aria-label={t("trace.detail.title")}
      data-testid="frame-detail"
    >
      <header>
        <strong>
          {idText(line)}
          {isCan(line) && "h"} · {serviceText(line, t)}
          {line.device !== null && ` · ${nameOf(line.device)}`}
        </strong>
        <Narrow line={line} />
        <CloseButton
          aria-label={t("trace.detail.close")}
          onClick={() => onPick(null)}
          data-testid="frame-close"
        />
      </header>
      <dl>
        <Fact name="time">
          <span title={`${BigInt(line.t_ns).toString()} ns`}>{exactTime(line.t_ns)}</span>
        </Fact>
        {previous && <Fact name="since_previous">{ms(line.t_ns - previous.t_ns)} ms</Fact>}
        <Facts line={line} />
        {line.step !== null && <Fact name="step">{t(`trace.step.${line.step}`)}</Fact>}
        {line.items.map((item, at) => (
          <Fact key={`${item.address}-${String(at)}`} name="object">
            <code>{item.address}</code> {objectName(item, t)}{" "}
            {item.text !== null && <b>{valueText(item, t)}</b>}
            {item.bits.length > 0 && (
              <span className="dim"> {item.bits.map((bit) => t(bit)).join(" · ")}</span>
            )}
          </Fact>
        ))}
        {noteTexts(line, t).map((note) => (
          <Fact key={note} name="note">
            <span className={line.tone === "error" ? "tone-error" : ""}>{note}</span>
          </Fact>
        ))}
        <Partner line={line} rows={rows} onPick={onPick} />
      </dl>
    </section>
  );
}

function Facts({ line }: { line: TraceLine }) {
  if (line.fdl) return <FdlFacts line={line} fdl={line.fdl} />;
  return line.transaction === null ? <CanFacts line={line} /> : <AduFacts line={line} />;
}

function CanFacts({ line }: { line: TraceLine }) {
  const t = useTexts();
  return (
    <>
      <Fact name="identifier">
        {idText(line)}h · {t(`trace.detail.${line.extended ? "extended" : "standard"}`)} · {line.bus} ·{" "}
        {t(`trace.detail.direction_${line.direction}`)}
        {line.remote && ` · ${t("trace.detail.remote")}`}
      </Fact>
      <Fact name="bytes">
        <b className={classes.bytes}>{bytesOf(line.data).join(" ") || "–"}</b>
        <span className="dim">
          {" "}
          {t("trace.detail.dlc")} {line.dlc}
        </span>
      </Fact>
    </>
  );
}

/** Of an ADU of Modbus TCP: its transaction, its connection, and its bytes with the header apart. */
function AduFacts({ line }: { line: TraceLine }) {
  const t = useTexts();
  const bytes = bytesOf(line.data);
  return (
    <>
      <Fact name="transaction">
        {line.transaction} · {t("trace.detail.unit", { unit: parseInt(bytes[HEADER_BYTES - 1] ?? "", 16) })} ·{" "}
        {line.bus} · {t(`trace.detail.direction_${line.direction}`)}
      </Fact>
      {line.peer !== null && line.peer !== "" && <Fact name="client">{line.peer}</Fact>}
      <Fact name="bytes">
        <span className="dim">{bytes.slice(0, HEADER_BYTES).join(" ")}</span>{" "}
        <b className={classes.bytes}>{shownBytes(line).join(" ")}</b>
        <span className="dim"> {t("trace.detail.adu_bytes", { count: line.dlc })}</span>
      </Fact>
    </>
  );
}

/** Of a telegram of PROFIBUS: its ends, its access points, and its bytes part by part. */
function FdlFacts({ line, fdl }: { line: TraceLine; fdl: NonNullable<TraceLine["fdl"]> }) {
  const t = useTexts();
  const known = fdl.source !== null && fdl.destination !== null;
  const ends = { source: station(fdl.source), destination: station(fdl.destination) };
  const saps = { dsap: station(fdl.dsap), ssap: station(fdl.ssap) };
  return (
    <>
      <Fact name="telegram">
        {t(known ? "trace.detail.ends" : "trace.detail.ends_unknown", ends)}
        {(fdl.dsap !== null || fdl.ssap !== null) && ` · ${t("trace.detail.saps", saps)}`} · {line.bus} ·{" "}
        {t(`trace.detail.direction_${line.direction}`)}
      </Fact>
      <div className={classes.wide}>
        <dt>{t("trace.detail.bytes")}</dt>
        <dd className={classes.parts} data-testid="fdl-parts">
          {partsOf(line).map((part, at) => (
            <span key={`${part.name}-${String(at)}`} className={classes.part} data-kind={part.kind}>
              <small>{part.kind === "head" ? part.name : t(`trace.detail.part_${part.name}`)}</small>
              <b className={classes.bytes}>{part.bytes.join(" ")}</b>
            </span>
          ))}
          <span className="dim">{t("trace.detail.fdl_bytes", { count: line.dlc })}</span>
        </dd>
      </div>
    </>
  );
}

function Fact({ name, children }: { name: string; children: ReactNode }) {
  const t = useTexts();
  return (
    <div>
      <dt>{t(`trace.detail.${name}`)}</dt>
      <dd>{children}</dd>
    </div>
  );
}

function Partner({ line, rows, onPick }: Props) {
  const t = useTexts();
  const answer = line.start_t_ns !== null && line.start_t_ns !== line.t_ns;
  const partner = partnerOf(line, rows);
  const otherNs = answer ? line.start_t_ns : (partner?.t_ns ?? null);
  if (otherNs === null) return null;
  return (
    <Fact name={answer ? "request" : "answer"}>
      {t("trace.detail.pair", {
        ms: figure(Math.abs(line.t_ns - otherNs) / 1e6, 3, t.language),
        side: t(`trace.detail.${answer ? "earlier" : "later"}`),
      })}{" "}
      <button
        type="button"
        className={classes.link}
        onClick={() => onPick(otherNs)}
        data-testid="frame-partner"
      >
        {t("trace.detail.show")} ({timeOfDay(otherNs / 1e6)})
      </button>
    </Fact>
  );
}

/** From one frame to all of its kind. */
function Narrow({ line }: { line: TraceLine }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const address = line.items[0]?.address;
  return (
    <span className={classes.narrow}>
      {isCan(line) && (
        <Button px="sm" variant="default" onClick={() => update({ ids: idText(line) })}>
          {t("trace.detail.only_id")}
        </Button>
      )}
      {line.node > 0 && (
        <Button px="sm" variant="default" onClick={() => update({ nodes: String(line.node) })}>
          {t("trace.detail.only_node")}
        </Button>
      )}
      {address !== undefined && (
        <Button px="sm" variant="default" onClick={() => update({ q: address })}>
          {t("trace.detail.only_object")}
        </Button>
      )}
    </span>
  );
}
