import { useState } from "react";
import { type BrakeTest, type Feathered, moving, type Order } from "../../api/motion";
import { useDerived } from "../../live/live";
import type { DeviceContext } from "../../model/shown";
import { figure } from "../../model/values";
import { scaledAt } from "../../motion/drive";
import { Control, useControl } from "../../motion/lease";
import motion from "../../motion/Motion.module.css";
import { OrderProblem } from "../../motion/OrderProblem";
import { RunButton } from "../../motion/RunButton";
import { useOrder } from "../../motion/useOrder";
import { useTexts } from "../../texts/texts";
import { entriesOf } from "../../ui/reading";
import { bitState } from "../overview/layout";

const FEATHER_TARGET = "567A";
/** By its bit the test of the brake sees whether it is lifted. */
const OUTPUTS = "60FE:03";
const BRAKE = "brake";
/** A blade that stands so near at its target has not been driven. */
const AT_TARGET_DEG = 0.5;

/** Which trials the drive has, and where its feather position is. */
function trialsOf(context: DeviceContext | null) {
  return {
    feathers: context !== null && entriesOf(context.doc).has(FEATHER_TARGET),
    hasBrake: context !== null && bitState(context, OUTPUTS, BRAKE) !== null,
    target: context === null ? null : scaledAt(context, FEATHER_TARGET),
  };
}

/** Trials of one axis, each as long as it is held: enabled and standing, its EFC, its brake. */
export function TrySection({ device, context }: { device: string; context: DeviceContext | null }) {
  const t = useTexts();
  const { motion: line, state } = useControl();
  const order = useOrder();
  const [feathered, setFeathered] = useState<Feathered | null>(null);
  const [brake, setBrake] = useState<BrakeTest | null>(null);
  const ready = state === Control.Own && line?.prepared.some((one) => one.device === device) === true;
  const disabled = !ready || order.isPending || line.running !== null;
  const doing = line?.running?.device === device ? line.running.doing : null;
  const { feathers, hasBrake, target } = useDerived([`device:${device}`], () => trialsOf(context));
  const hold = (work: (one: Order) => Promise<unknown>) => {
    setFeathered(null);
    setBrake(null);
    order.mutate({ held: true, work });
  };
  return (
    <section aria-label={t("page.motion.try")}>
      <h3>{t("page.motion.try")}</h3>
      <div className={`${motion.row} ${motion.runs}`}>
        <RunButton
          hint={t("page.motion.hold_hint")}
          disabled={disabled}
          active={doing === "hold"}
          onPress={() => hold((one) => moving.hold(device, one))}
          testId="hold"
        >
          {t("page.motion.hold_enabled")}
        </RunButton>
        {feathers && (
          <RunButton
            hint={t("page.motion.feather_hint", {
              angle: target === null ? "–" : figure(target, 1, t.language),
            })}
            disabled={disabled}
            active={doing === "feather"}
            onPress={() => hold((one) => moving.feather(device, one).then(setFeathered))}
            testId="try-feather"
          >
            {t("page.motion.feather")}
          </RunButton>
        )}
        {hasBrake && (
          <RunButton
            hint={t("page.motion.brake_hint")}
            disabled={disabled}
            active={doing === "brake_test"}
            onPress={() => hold((one) => moving.brakeTest(device, one).then(setBrake))}
            testId="brake-test"
          >
            {t("page.motion.brake")}
          </RunButton>
        )}
      </div>
      {feathered && <FeatherResult found={feathered} />}
      {brake && <BrakeResult found={brake} />}
      <OrderProblem error={order.error} title={t("page.motion.order_failed")} />
    </section>
  );
}

function FeatherResult({ found }: { found: Feathered }) {
  const t = useTexts();
  const degrees = (deg: number) => figure(deg, 2, t.language);
  const stood = Math.abs(found.from_deg - found.target_deg) <= AT_TARGET_DEG;
  return (
    <p data-testid="feather-result">
      {stood
        ? t("page.motion.feather_stood", { angle: degrees(found.from_deg) })
        : t("page.motion.feathered", {
            from: degrees(found.from_deg),
            to: degrees(found.to_deg),
            target: degrees(found.target_deg),
            seconds: figure(found.took_s, 1, t.language),
            ended_key: `motion.ended.${found.why}`,
          })}
    </p>
  );
}

function BrakeResult({ found }: { found: BrakeTest }) {
  const t = useTexts();
  const { verdict } = found;
  const ms = (s: number | null) => (s === null ? "–" : String(Math.round(1000 * s)));
  const degrees = (deg: number | null) => (deg === null ? "–" : figure(deg, 2, t.language));
  const tone = verdict === "holds" ? "" : verdict === null ? "dim" : "tone-error";
  return (
    <div data-testid="brake-result" data-verdict={verdict ?? "none"}>
      <p className={tone}>
        <strong>{verdict === null ? t("page.motion.brake_none") : t(`brake_verdict.${verdict}`)}</strong>
      </p>
      <p className="dim">
        {t("page.motion.brake_seen", {
          lifted: ms(found.lifted_s),
          turned: degrees(found.turned_deg),
          engaged: ms(found.engaged_s),
          drift: degrees(found.drift_deg),
        })}
      </p>
    </div>
  );
}
