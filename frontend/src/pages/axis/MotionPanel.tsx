import { useTexts } from "../../texts/texts";
import type { DeviceRef } from "../../api/types";
import { Control, useControl } from "../../motion/lease";
import motion from "../../motion/Motion.module.css";
import classes from "./Axis.module.css";
import { ControlSection } from "./ControlSection";
import { HomeSection } from "./HomeSection";
import { Interlocks } from "./Interlocks";
import { MoveSection } from "./MoveSection";
import { PrepareSection } from "./PrepareSection";
import { ProbeSection } from "./ProbeSection";
import { SignalSection } from "./SignalSection";

/** Moving the blade from here: control, what holds it back, the proof that it stops, then hold to run. */
export function MotionPanel({ device }: { device: DeviceRef }) {
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
        <div>
          <PrepareSection device={device.slug} />
          <HomeSection device={device.slug} />
        </div>
        <MoveSection device={device.slug} />
        <SignalSection device={device.slug} />
        <ProbeSection device={device.slug} />
      </div>
      <p className={motion.plain}>{t("page.motion.no_safety")}</p>
    </section>
  );
}
