import { NumberInput } from "@mantine/core";
import { useState } from "react";
import { moving, type Order } from "../../api/motion";
import type { StationRef } from "../../api/types";
import { useDerived } from "../../live/live";
import { measuresOf, useAxisNow, useUnwatched } from "../../motion/axis";
import { scaledAt } from "../../motion/drive";
import { Control, useControl } from "../../motion/lease";
import motion from "../../motion/Motion.module.css";
import { OrderProblem } from "../../motion/OrderProblem";
import { RunButton } from "../../motion/RunButton";
import { useOrder } from "../../motion/useOrder";
import type { DeviceContext } from "../../model/shown";
import { figure } from "../../model/values";
import { useTexts } from "../../texts/texts";
import { typedNumber } from "../../ui/typedNumber";
import { Preview } from "./Preview";

/** The fastest by hand at a blade; the server refuses more. */
const MOST_DPS = 5;
const USUAL_DPS = 2;
const USUAL_DEG = 85;
/** Elsewhere what the drive itself holds bounds the speed, and a small part of that is begun with. */
const BOUNDS = ["607F", "6080"];
const OF_MOST = 500;

enum Way {
  Minus = "minus",
  Plus = "plus",
  To = "to",
}

interface Props {
  station: StationRef;
  device: string;
  context: DeviceContext | null;
}

function mostOf(context: DeviceContext | null): number | undefined {
  const bounds = BOUNDS.flatMap((address) => (context ? (scaledAt(context, address) ?? []) : []));
  const set = bounds.filter((bound) => bound > 0);
  return set.length === 0 ? undefined : Math.min(...set);
}

/** Hold to run: jog to either side, or move to a position, with what will come of it. */
export function MoveSection({ station, device, context }: Props) {
  const t = useTexts();
  const { motion: line, state } = useControl();
  const order = useOrder();
  const blade = station.blade !== null;
  const [typedSpeed, setSpeed] = useState<number | null>(null);
  const [angle, setAngle] = useState(blade ? USUAL_DEG : 0);
  const known = useAxisNow(station, context, ({ position }) => position !== null);
  const measures = useDerived([`device:${device}`], () => measuresOf(context));
  const bound = useDerived([`device:${device}`], () => (blade ? MOST_DPS : mostOf(context)));
  const usual = blade ? USUAL_DPS : Math.max(1, Math.round((bound ?? 0) / OF_MOST));
  const speed = typedSpeed ?? usual;
  const degrees = measures.position.unit === "°";
  const suffix = degrees ? "°" : ` ${measures.position.unit}`;
  const ready = state === Control.Own && line?.prepared.some((one) => one.device === device) === true;
  const busy = order.isPending || line?.running != null;
  const doing = line?.running?.device === device ? line.running.doing : null;
  const [pressed, setPressed] = useState<Way | null>(null);
  const hold = (way: Way, work: (one: Order) => Promise<unknown>) => {
    setPressed(way);
    order.mutate({ held: true, work });
  };
  // What a drive does alone that cannot watch us, nobody knows.
  const unwatched = useUnwatched(device);
  const ended = (why: string) =>
    unwatched && why === "link" ? "page.motion.link_unknown_short" : `motion.ended.${why}`;
  const active = (way: Way) => doing !== null && pressed === way;
  return (
    <section aria-label={t("page.motion.move")}>
      <h3>{t("page.motion.move")}</h3>
      <div className={motion.row}>
        <NumberInput
          label={t("page.motion.speed")}
          value={speed}
          onChange={(value) => typedNumber(value, setSpeed)}
          min={0.1}
          {...(bound === undefined ? {} : { max: bound })}
          allowNegative={false}
          clampBehavior="strict"
          step={blade ? 0.5 : 10}
          decimalScale={measures.speed.decimals}
          suffix={` ${measures.speed.unit}`}
          w={130}
          data-testid="speed"
        />
        <NumberInput
          label={t(degrees ? "page.motion.angle" : "page.motion.position")}
          value={angle}
          onChange={(value) => typedNumber(value, setAngle)}
          step={1}
          decimalScale={measures.position.decimals}
          suffix={suffix}
          w={130}
          data-testid="angle"
        />
      </div>
      <div className={`${motion.row} ${motion.runs}`}>
        <RunButton
          hint={t(blade ? "page.motion.to_zero" : "page.motion.negative")}
          disabled={!ready || busy}
          active={active(Way.Minus)}
          onPress={() => hold(Way.Minus, (one) => moving.jog(device, one, -Math.abs(speed)))}
          testId="jog-minus"
        >
          ◀ {t("page.motion.jog")}
        </RunButton>
        <RunButton
          hint={t(blade ? "page.motion.to_feather" : "page.motion.positive")}
          disabled={!ready || busy}
          active={active(Way.Plus)}
          onPress={() => hold(Way.Plus, (one) => moving.jog(device, one, Math.abs(speed)))}
          testId="jog-plus"
        >
          {t("page.motion.jog")} ▶
        </RunButton>
        <RunButton
          hint={t("page.motion.hold")}
          disabled={!ready || busy}
          active={active(Way.To)}
          onPress={() => hold(Way.To, (one) => moving.move(device, one, angle, speed))}
          testId="move-to"
        >
          {t("page.motion.move_to_position", {
            position: `${figure(angle, measures.position.decimals, t.language)}${suffix}`,
          })}
        </RunButton>
      </div>
      <div className={motion.row}>
        <span className={motion.ended} data-testid="motion-ended">
          {line?.ended?.device === device &&
            doing === null &&
            `${t(`motion.doing.${line.ended.doing}`)}: ${t(ended(line.ended.why))}`}
        </span>
      </div>
      {context && known && <Preview station={station} context={context} to={angle} speed={speed} />}
      <OrderProblem error={order.error} title={t("page.motion.order_failed")} />
    </section>
  );
}
