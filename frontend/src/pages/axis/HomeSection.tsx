import { NumberInput } from "@mantine/core";
import { useState } from "react";
import { moving } from "../../api/motion";
import { useDerived } from "../../live/live";
import type { LiveStore } from "../../live/store";
import { figure } from "../../model/values";
import { Control, useControl } from "../../motion/lease";
import motion from "../../motion/Motion.module.css";
import { OrderProblem } from "../../motion/OrderProblem";
import { useOrder } from "../../motion/useOrder";
import { useTexts } from "../../texts/texts";
import { HoldButton } from "../../ui/HoldButton";
import { typedNumber } from "../../ui/typedNumber";

const FEATHER_DEG = 90;
const AT_REST_DPS = 0.05;
const WITHOUT_POWER = ["ready_to_switch_on", "switch_on_disabled"];

const axisOf = (store: LiveStore, device: string) =>
  [...store.axes.values()].find((one) => device.startsWith(one.station));

function restOf(store: LiveStore, device: string) {
  const axis = axisOf(store, device);
  return {
    withoutPower: WITHOUT_POWER.includes(axis?.state?.split(".").at(-1) ?? ""),
    still: Math.abs(axis?.velocity_dps ?? 1) <= AT_REST_DPS,
  };
}

/** Homing, method 35: where the blade stands now is called an angle. Nothing moves; it must stand without power. */
export function HomeSection({ device }: { device: string }) {
  const t = useTexts();
  const { motion: line, state } = useControl();
  const order = useOrder();
  const [angle, setAngle] = useState(FEATHER_DEG);
  const rests = useDerived(["axes"], (store) => restOf(store, device));
  const ready = state === Control.Own && line?.prepared.some((one) => one.device === device) === true;
  const busy = order.isPending || line?.running != null;
  const lacks = [
    ...(rests.withoutPower ? [] : ["page.motion.home_power"]),
    ...(rests.still ? [] : ["page.motion.home_moves"]),
    ...(ready ? [] : ["page.motion.home_prepare"]),
  ];
  return (
    <section aria-label={t("page.motion.home")}>
      <h3>{t("page.motion.home")}</h3>
      <Explained device={device} />
      <div className={motion.row}>
        <NumberInput
          label={t("page.motion.home_angle")}
          value={angle}
          onChange={(value) => typedNumber(value, setAngle)}
          decimalScale={2}
          suffix="°"
          w={130}
          data-testid="home-angle"
        />
        <HoldButton
          hint={t("page.motion.home_hint")}
          tone="danger"
          disabled={lacks.length > 0 || busy}
          onHeld={() => order.mutate({ held: false, work: (one) => moving.home(device, one, angle) })}
          testId="home"
        >
          {t("page.motion.home_take", { angle: figure(angle, 2, t.language) })}
        </HoldButton>
      </div>
      {lacks.map((key) => (
        <p key={key} className="dim">
          {t(key)}
        </p>
      ))}
      <OrderProblem error={order.error} title={t("page.motion.home_failed")} />
    </section>
  );
}

/** What it does, with the angle at which the blade stands now. */
function Explained({ device }: { device: string }) {
  const t = useTexts();
  const angle = useDerived(["axes"], (store) => {
    const deg = axisOf(store, device)?.position_deg;
    return deg == null ? "–" : figure(deg, 2, t.language);
  });
  return <p>{t("page.motion.home_explain", { angle })}</p>;
}
