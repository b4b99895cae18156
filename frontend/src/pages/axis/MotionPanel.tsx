import { useTexts } from "../../texts/texts";
import type { DeviceRef } from "../../api/types";
import type { DeviceContext } from "../../model/shown";
import { Control, useControl } from "../../motion/lease";
import motion from "../../motion/Motion.module.css";
import classes from "./Axis.module.css";
import { ControlSection } from "./ControlSection";
import { EndSection } from "./EndSection";
import { HomeSection } from "./HomeSection";
import { Interlocks } from "./Interlocks";
import { MoveSection } from "./MoveSection";
import { PrepareSection } from "./PrepareSection";
import { TrySection } from "./TrySection";
import { ProbeSection } from "./ProbeSection";
import { SignalSection } from "./SignalSection";

/** Moving the blade from here: control, what holds it back, the proof that it stops, then hold to run. */
export function MotionPanel({ device, context }: { device: DeviceRef; context: DeviceContext | null }) {
  const t = useTexts();
  const { state } = useControl();
  if (state === Control.None) return null;
  return (
    <section
      className={`${classes.panel} ${classes.wide}`}
      aria-label={t("page.motion.title")}
      data-testid="motion"
    >
      <h2>{t("page.motion.title")}</h2>
      <div className={motion.panel}>
        <ControlSection />
        <Interlocks device={device.slug} />
        <PrepareSection device={device.slug} />
        <MoveSection device={device.slug} context={context} />
        <TrySection device={device.slug} context={context} />
        <HomeSection device={device.slug} />
        <EndSection device={device.slug} />
        <SignalSection device={device.slug} />
        <ProbeSection device={device.slug} />
      </div>
      <p className={motion.plain}>{t("page.motion.no_safety")}</p>
    </section>
  );
}
