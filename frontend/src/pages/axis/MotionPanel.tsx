import { Alert } from "@mantine/core";
import { IconPlugConnectedX } from "@tabler/icons-react";
import { useTexts } from "../../texts/texts";
import { entriesOf } from "../../ui/reading";
import { searches, useUnwatched } from "../../motion/axis";
import type { DeviceRef, StationRef } from "../../api/types";
import type { DeviceContext } from "../../model/shown";
import { Control, useControl } from "../../motion/lease";
import motion from "../../motion/Motion.module.css";
import classes from "./Axis.module.css";
import { ControlSection } from "./ControlSection";
import { EndSection } from "./EndSection";
import { HomeSection } from "./HomeSection";
import { HydraulicMoves } from "./HydraulicMoves";
import { HydraulicOperation } from "./HydraulicOperation";
import { Interlocks } from "./Interlocks";
import { MoveSection } from "./MoveSection";
import { PrepareSection } from "./PrepareSection";
import { TrySection } from "./TrySection";
import { SearchHomeSection } from "./SearchHomeSection";
import { ProbeSection } from "./ProbeSection";
import { SignalSection } from "./SignalSection";

/** Test signals are judged by it. */
const POSITION_GAIN = "60FB:01";
const PROBE = "60BA";

interface Props {
  station: StationRef;
  device: DeviceRef;
  context: DeviceContext | null;
}

/** Moving the blade from here: control, what holds it back, the proof that it stops, then hold to run. */
export function MotionPanel({ station, device, context }: Props) {
  const t = useTexts();
  const { state, motion: line } = useControl();
  const unwatched = useUnwatched(device.slug);
  if (state === Control.None) return null;
  const blade = station.blade !== null;
  const has = (address: string) => context !== null && entriesOf(context.doc).has(address);
  const hydraulic = context?.doc.state_machine?.profile === "dsp408";
  // Words of a blade for what turns one.
  const words = (key: string) =>
    t(hydraulic ? `page.hydraulic.${key}` : blade ? `page.motion.${key}` : `page.motion.axis_${key}`);
  const lost = unwatched && line?.ended?.device === device.slug && line.ended.why === "link";
  return (
    <section className={`${classes.panel} ${classes.wide}`} aria-label={words("title")} data-testid="motion">
      <h2>{words("title")}</h2>
      {lost && (
        <Alert color="red" icon={<IconPlugConnectedX aria-hidden />} role="alert" data-testid="link-unknown">
          {t("page.motion.link_unknown")}
        </Alert>
      )}
      <div className={motion.panel}>
        <ControlSection device={device.slug} />
        <Interlocks device={device.slug} title={words("interlocks")} />
        <PrepareSection device={device.slug} of={hydraulic ? "hydraulic" : "motion"} />
        {hydraulic ? (
          <>
            <HydraulicMoves station={station} device={device.slug} context={context} />
            <HydraulicOperation device={device.slug} context={context} />
          </>
        ) : (
          <>
            <MoveSection station={station} device={device.slug} context={context} />
            <TrySection device={device.slug} context={context} />
            {searches(context) ? (
              <SearchHomeSection device={device.slug} context={context} />
            ) : (
              <HomeSection device={device.slug} />
            )}
          </>
        )}
        <EndSection device={device.slug} title={words("end")} />
        {hydraulic ? null : has(POSITION_GAIN) ? (
          <SignalSection device={device.slug} />
        ) : (
          context && <p className="dim">{t("page.motion.no_signals")}</p>
        )}
        {has(PROBE) && <ProbeSection device={device.slug} />}
      </div>
      <p className={motion.plain}>{words("no_safety")}</p>
    </section>
  );
}
