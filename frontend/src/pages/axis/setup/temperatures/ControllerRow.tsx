import { Button } from "@mantine/core";
import { IconArrowRight } from "@tabler/icons-react";
import { useState } from "react";
import { usePageSearch } from "../../../../frame/search";
import type { DeviceContext } from "../../../../model/shown";
import { setBits } from "../../../../model/bits";
import { useTexts } from "../../../../texts/texts";
import { bitState, type Temperature } from "../../../overview/layout";
import type { Edge } from "../common/bounds";
import { Findings, findingsOf } from "../common/Findings";
import { Mark } from "../common/Mark";
import { boundsOf, type Parameter, scaled, type Setup } from "../common/parameter";
import type { Scale } from "../common/scale";
import classes from "../common/Setup.module.css";
import { stopText } from "../common/stopText";
import { type Band, type Line, Track } from "../common/Track";
import { TypedValue } from "../common/TypedValue";
import { controlBounds, type ControllerLane, hysteresisBounds, type MarkKind, STEP } from "./lanes";
import { Lit } from "./Lit";

const PAGE_C = 5;

interface Props {
  lane: ControllerLane;
  spot: Temperature;
  unit: DeviceContext | null;
  setup: Setup;
  scale: Scale;
  live: Line | null;
}

/** Heating, cooling and fan of one place: where each begins, and the hysteresis until which it goes on. */
export function ControllerRow({ lane, spot, unit, setup, scale, live }: Props) {
  const t = useTexts();
  const [stopped, setStopped] = useState<{ parameter: Parameter; by: Edge } | null>(null);
  const place = t(`page.temperature.${spot.key}`);
  const short = (kind: MarkKind) => t(`page.setup.temperatures.short.${kind}`);
  const kindName = (kind: MarkKind) => t(`page.setup.temperatures.mark.${kind}`);
  const look = (address: string) => setup.of(unit, address)?.raw ?? null;
  const coolerKind: MarkKind = lane.heater === null ? "fan" : "cooler";
  const at = [
    ...(lane.heater === null ? [] : [{ kind: "heater" as MarkKind, address: lane.heater }]),
    { kind: coolerKind, address: lane.cooler },
  ];
  const marks = at.flatMap(({ kind, address }) => {
    const parameter = setup.of(unit, address);
    if (!parameter) return [];
    const bounds = boundsOf(parameter, controlBounds(lane, address, look, kindName), look);
    return [{ kind, parameter, bounds, name: `${place}: ${kindName(kind)} (${address})` }];
  });
  const hysteresis = setup.of(unit, lane.hysteresis);
  const delay = lane.delay === null ? null : setup.of(unit, lane.delay);
  const masks = lane.outputs.map((one) => setup.of(unit, one.address));
  return (
    <>
      <div className={classes.lane} data-testid={`lane-${lane.index}`}>
        <div className={classes.about}>
          <span>
            {t(
              lane.heater === null
                ? "page.setup.temperatures.fan_controller"
                : "page.setup.temperatures.controller",
            )}{" "}
            <small>
              {unit?.doc.name} · {lane.index}h
            </small>
          </span>
          <Lit states={statesOf(lane, unit)} />
        </div>
        <Track scale={scale} step={STEP} rows={1} bands={bandsOf(marks, hysteresis, t)} lines={[live]}>
          {marks.map(({ kind, parameter, bounds, name }) => (
            <Mark
              key={kind}
              parameter={parameter}
              name={name}
              label={short(kind)}
              scale={scale}
              bounds={bounds}
              snap={1}
              page={PAGE_C}
              tone={kind === "heater" ? "cold" : "warm"}
              onStopped={(by) => setStopped(by && { parameter, by })}
            />
          ))}
        </Track>
        <div className={classes.numbers}>
          {marks.map(({ kind, parameter, bounds, name }) => (
            <TypedValue key={kind} parameter={parameter} name={name} label={short(kind)} bounds={bounds} />
          ))}
          {hysteresis && (
            <TypedValue
              parameter={hysteresis}
              name={`${place}: ${t("page.setup.temperatures.hysteresis")} (${lane.hysteresis})`}
              label={t("page.setup.temperatures.short.hysteresis")}
              bounds={boundsOf(hysteresis, hysteresisBounds(lane, look, kindName), look)}
            />
          )}
          {delay && (
            <TypedValue
              parameter={delay}
              name={`${place}: ${t("page.setup.temperatures.delay")} (${lane.delay})`}
              label={t("page.setup.temperatures.short.delay")}
              bounds={boundsOf(delay, { low: null, high: null }, look)}
            />
          )}
        </div>
        <p className={classes.stopped} role="status" data-testid={`stopped-${lane.index}`}>
          {stopped && stopText(stopped.parameter, stopped.by, t)}
        </p>
      </div>
      <Outputs lane={lane} masks={masks} />
      <Findings findings={findingsOf([...marks.map((one) => one.parameter), hysteresis])} />
    </>
  );
}

/** The clamps that each function drives, and the way to where they are given. */
function Outputs({ lane, masks }: { lane: ControllerLane; masks: readonly (Parameter | null)[] }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const clamps = (mask: Parameter | null) => {
    if (mask?.raw == null) return "–";
    const table = mask.context.doc.bit_tables[mask.entry.bits ?? ""] ?? [];
    const names = setBits(mask.entry, mask.raw, table).map((bit) => bit.clamp ?? t(bit.text_key));
    return names.length === 0 ? t("page.setup.temperatures.no_output") : names.join(", ");
  };
  const off = masks.every((mask) => mask?.raw === 0);
  return (
    <p className={classes.outputs} data-testid={`outputs-${lane.index}`}>
      {lane.outputs.map(({ kind, address }, at) => (
        <span key={address}>
          {t(`page.setup.temperatures.output.${kind}`)}: <b>{clamps(masks[at] ?? null)}</b>
          {masks[at]?.change && " ✎"}
        </span>
      ))}
      {off && <em>{t("page.setup.temperatures.off")}</em>}
      <Button
        variant="subtle"
        size="xs"
        h={40}
        rightSection={<IconArrowRight size={14} aria-hidden />}
        onClick={() => update({ picture: "masks" })}
      >
        {t("page.setup.temperatures.to_masks")}
      </Button>
    </p>
  );
}

interface Placed {
  kind: MarkKind;
  parameter: Parameter;
}

/** From where each begins to where its hysteresis lets it end. */
function bandsOf(marks: readonly Placed[], hysteresis: Parameter | null, t: (key: string) => string): Band[] {
  if (hysteresis?.raw == null) return [];
  const wide = scaled(hysteresis, hysteresis.raw);
  return marks.flatMap(({ kind, parameter }): Band[] => {
    if (parameter.raw === null) return [];
    const at = scaled(parameter, parameter.raw);
    const title = t(`page.setup.temperatures.band.${kind}`);
    return kind === "heater"
      ? [{ key: kind, from: at, to: at + wide, tone: "cold", title }]
      : [{ key: kind, from: at - wide, to: at, tone: "warm", title }];
  });
}

const RUNNING = ["heater_on", "cooler_on", "fan_on"];
const OUTPUTS_NOW = "30FE:03";

/** What runs, by its status; the motor fan has none, so that its outputs tell. */
function statesOf(lane: ControllerLane, unit: DeviceContext | null): string[] {
  if (!unit) return [];
  const { status } = lane;
  if (status !== null) return RUNNING.filter((bit) => bitState(unit, status, bit)?.set);
  const [mask, now] = [unit.lookup(lane.outputs[0]?.address ?? ""), unit.lookup(OUTPUTS_NOW)];
  return typeof mask === "number" && typeof now === "number" && (mask & now) !== 0 ? ["fan_on"] : [];
}
