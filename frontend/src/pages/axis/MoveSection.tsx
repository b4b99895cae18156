import { NumberInput } from "@mantine/core";
import { useState } from "react";
import { moving, type Order } from "../../api/motion";
import { useAxes } from "../../live/live";
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

/** The fastest by hand; the server refuses more. */
const MOST_DPS = 5;
const USUAL_DPS = 2;

enum Way {
  Minus = "minus",
  Plus = "plus",
  To = "to",
}

/** Hold to run: jog to either side, or move to an angle, with what will come of it. */
export function MoveSection({ device, context }: { device: string; context: DeviceContext | null }) {
  const t = useTexts();
  const { motion: line, state } = useControl();
  const order = useOrder();
  const [speed, setSpeed] = useState(USUAL_DPS);
  const [angle, setAngle] = useState(85);
  const axis = [...useAxes().values()].find((one) => device.startsWith(one.station));
  const ready = state === Control.Own && line?.prepared.some((one) => one.device === device) === true;
  const busy = order.isPending || line?.running != null;
  const doing = line?.running?.device === device ? line.running.doing : null;
  const [pressed, setPressed] = useState<Way | null>(null);
  const hold = (way: Way, work: (one: Order) => Promise<unknown>) => {
    setPressed(way);
    order.mutate({ held: true, work });
  };
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
          max={MOST_DPS}
          allowNegative={false}
          clampBehavior="strict"
          step={0.5}
          decimalScale={2}
          suffix=" °/s"
          w={130}
          data-testid="speed"
        />
        <NumberInput
          label={t("page.motion.angle")}
          value={angle}
          onChange={(value) => typedNumber(value, setAngle)}
          step={1}
          decimalScale={2}
          suffix="°"
          w={130}
          data-testid="angle"
        />
      </div>
      <div className={`${motion.row} ${motion.runs}`}>
        <RunButton
          hint={t("page.motion.to_zero")}
          disabled={!ready || busy}
          active={active(Way.Minus)}
          onPress={() => hold(Way.Minus, (one) => moving.jog(device, one, -Math.abs(speed)))}
          testId="jog-minus"
        >
          ◀ {t("page.motion.jog")}
        </RunButton>
        <RunButton
          hint={t("page.motion.to_feather")}
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
          {t("page.motion.move_to", { angle: figure(angle, 2, t.language) })}
        </RunButton>
      </div>
      <div className={motion.row}>
        <span className={motion.ended} data-testid="motion-ended">
          {line?.ended?.device === device &&
            doing === null &&
            `${t(`motion.doing.${line.ended.doing}`)}: ${t(`motion.ended.${line.ended.why}`)}`}
        </span>
      </div>
      {context && axis?.position_deg != null && (
        <Preview context={context} fromDeg={axis.position_deg} toDeg={angle} speedDps={speed} />
      )}
      <OrderProblem error={order.error} title={t("page.motion.order_failed")} />
    </section>
  );
}
