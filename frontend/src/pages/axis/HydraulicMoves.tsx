import { NumberInput, SegmentedControl } from "@mantine/core";
import { useState } from "react";
import { moving, type Order } from "../../api/motion";
import type { StationRef } from "../../api/types";
import { useDeviceVersion } from "../../live/live";
import type { DeviceContext } from "../../model/shown";
import { figure } from "../../model/values";
import { measuresOf, useAxisNow, useUnwatched } from "../../motion/axis";
import { scaledAt } from "../../motion/drive";
import { Control, useControl } from "../../motion/lease";
import motion from "../../motion/Motion.module.css";
import { OrderProblem } from "../../motion/OrderProblem";
import { RunButton } from "../../motion/RunButton";
import { useOrder } from "../../motion/useOrder";
import { useTexts } from "../../texts/texts";
import { typedNumber } from "../../ui/typedNumber";

const RAPID_SPEED = "12/216";
const CREEP_SPEED = "12/217";
/** What was commissioned: a move by hand is never faster. */
const MOST_SPEED = "12/61";
const LIMITED = "1/106";
const LOWEST = "1/100";
const HIGHEST = "1/101";
/** A move begins with a small part of the most. */
const OF_MOST = 5;

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

/** Hold to run: manual control to either side, a move to a place, or held where it stands. */
export function HydraulicMoves({ station, device, context }: Props) {
  const t = useTexts();
  const { motion: line, state } = useControl();
  const order = useOrder();
  useDeviceVersion(device);
  const here = useAxisNow(station, context, ({ position }) =>
    position === null ? null : Math.round(position),
  );
  const unwatched = useUnwatched(device);
  const [rapid, setRapid] = useState(false);
  const [typedPlace, setPlace] = useState<number | null>(null);
  const [typedSpeed, setSpeed] = useState<number | null>(null);
  const [pressed, setPressed] = useState<Way | null>(null);
  const at = (address: string) => (context ? scaledAt(context, address) : null);
  const { position, speed: measure } = measuresOf(context);
  const unit = position.unit;
  const most = at(MOST_SPEED);
  const speed = typedSpeed ?? (most === null ? 1 : most / OF_MOST);
  const place = typedPlace ?? here ?? 0;
  const window = { on: context?.lookup(LIMITED) === 1, low: at(LOWEST), high: at(HIGHEST) };
  const shut = window.on && window.low !== null && window.high !== null && window.low >= window.high;
  const ready =
    state === Control.Own && line?.prepared.some((one) => one.device === device) === true && !shut;
  const disabled = !ready || order.isPending || line.running !== null;
  const doing = line?.running?.device === device ? line.running.doing : null;
  const hold = (way: Way | null, work: (one: Order) => Promise<unknown>) => {
    setPressed(way);
    order.mutate({ held: true, work });
  };
  const active = (way: Way) => (doing === "jog" || doing === "move") && pressed === way;
  const pace = (address: string) => {
    const found = at(address);
    return found === null ? "–" : `${figure(found, measure.decimals, t.language)} ${measure.unit}`;
  };
  const ended = (why: string) =>
    unwatched && why === "link" ? "page.motion.link_unknown_short" : `motion.ended.${why}`;
  return (
    <>
      <section aria-label={t("page.hydraulic.manual")}>
        <h3>{t("page.hydraulic.manual")}</h3>
        <SegmentedControl
          value={rapid ? "rapid" : "creep"}
          onChange={(value) => setRapid(value === "rapid")}
          data={[
            { value: "creep", label: t("page.hydraulic.creep") },
            { value: "rapid", label: t("page.hydraulic.rapid") },
          ]}
          aria-label={t("page.hydraulic.speed_way")}
          data-testid="manual-speed"
          size="md"
          fullWidth
          mb={8}
        />
        <div className={`${motion.row} ${motion.runs}`}>
          <RunButton
            hint={t("page.hydraulic.negative")}
            disabled={disabled}
            active={active(Way.Minus)}
            onPress={() => hold(Way.Minus, (one) => moving.manual(device, one, false, rapid))}
            testId="manual-minus"
          >
            ◀ {pace(rapid ? RAPID_SPEED : CREEP_SPEED)}
          </RunButton>
          <RunButton
            hint={t("page.hydraulic.positive")}
            disabled={disabled}
            active={active(Way.Plus)}
            onPress={() => hold(Way.Plus, (one) => moving.manual(device, one, true, rapid))}
            testId="manual-plus"
          >
            {pace(rapid ? RAPID_SPEED : CREEP_SPEED)} ▶
          </RunButton>
          <RunButton
            hint={t("page.motion.hold_hint")}
            disabled={disabled}
            active={doing === "hold"}
            onPress={() => hold(null, (one) => moving.hold(device, one))}
            testId="hold"
          >
            {t("page.motion.hold_enabled")}
          </RunButton>
        </div>
        <p className={shut ? "tone-error" : "dim"} data-testid="travel-window">
          {shut
            ? t("page.hydraulic.no_window")
            : window.on
              ? t("page.hydraulic.limits", {
                  low: window.low === null ? "–" : figure(window.low, 1, t.language),
                  high: window.high === null ? "–" : figure(window.high, 1, t.language),
                  unit,
                })
              : t("page.hydraulic.no_limits")}
        </p>
      </section>
      <section aria-label={t("page.hydraulic.profile")}>
        <h3>{t("page.hydraulic.profile")}</h3>
        <div className={motion.row}>
          <NumberInput
            label={t("page.motion.position")}
            value={place}
            onChange={(value) => typedNumber(value, setPlace)}
            decimalScale={position.decimals}
            allowNegative={false}
            step={1}
            suffix={` ${unit}`}
            w={140}
            data-testid="place"
          />
          <NumberInput
            label={t("page.motion.speed")}
            value={speed}
            onChange={(value) => typedNumber(value, setSpeed)}
            min={0.1}
            {...(most === null ? {} : { max: most })}
            allowNegative={false}
            clampBehavior="strict"
            decimalScale={measure.decimals}
            suffix={` ${measure.unit}`}
            w={140}
            data-testid="speed"
          />
        </div>
        <div className={`${motion.row} ${motion.runs}`}>
          <RunButton
            hint={t("page.motion.hold")}
            disabled={disabled}
            active={active(Way.To)}
            onPress={() => hold(Way.To, (one) => moving.move(device, one, place, speed))}
            testId="move-to"
          >
            {t("page.motion.move_to_position", {
              position: `${figure(place, position.decimals, t.language)} ${unit}`,
            })}
          </RunButton>
        </div>
        <span className={motion.ended} data-testid="motion-ended">
          {line?.ended?.device === device &&
            doing === null &&
            `${t(`motion.doing.${line.ended.doing}`)}: ${t(ended(line.ended.why))}`}
        </span>
        <p className="dim">{t("page.hydraulic.second")}</p>
        <OrderProblem error={order.error} title={t("page.motion.order_failed")} />
      </section>
    </>
  );
}
