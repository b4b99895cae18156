import { Select, TextInput } from "@mantine/core";
import { useState } from "react";
import { moving, type Order } from "../../../../api/motion";
import { Agreement, type Held, judge, LEAST_MOVE_DEG, ratioBy, type Witnessed } from "../../../../model/gear";
import { fraction, toNumber } from "../../../../model/decimal";
import type { DeviceContext } from "../../../../model/shown";
import { figure } from "../../../../model/values";
import { Control, useControl } from "../../../../motion/lease";
import motion from "../../../../motion/Motion.module.css";
import { OrderProblem } from "../../../../motion/OrderProblem";
import { RunButton } from "../../../../motion/RunButton";
import { useOrder } from "../../../../motion/useOrder";
import { useTexts } from "../../../../texts/texts";
import axis from "../../Axis.module.css";
import { ControlSection } from "../../ControlSection";
import { Interlocks } from "../../Interlocks";
import { PrepareSection } from "../../PrepareSection";
import classes from "./Gear.module.css";
import { BLADE, heldAt, MOTOR, sideInUse } from "./sides";

const MOVE_DEG = 10;
const SPEED_DPS = 1;

/** A slow move of ten degrees, and what motor encoder, blade encoder and the scale at the blade say of it. */
export function CheckMove({ pmc }: { pmc: DeviceContext }) {
  const t = useTexts();
  const { motion: line, state } = useControl();
  const order = useOrder();
  const [towards, setTowards] = useState<"minus" | "plus">("minus");
  const [moved, setMoved] = useState<{ motorDeg: number | null; bladeDeg: number | null } | null>(null);
  const [scale, setScale] = useState("");
  if (state === Control.None) return null;
  const device = pmc.slug;
  const ready = state === Control.Own && line?.prepared.some((one) => one.device === device) === true;
  const busy = order.isPending || line?.running != null;
  const run = async (one: Order) => {
    const before = await moving.positions(device);
    if (before.position_deg === null) throw new Error("the axis tells no position");
    const target = before.position_deg + (towards === "minus" ? -MOVE_DEG : MOVE_DEG);
    setMoved(null);
    setScale("");
    try {
      await moving.move(device, one, Math.round(target * 100) / 100, SPEED_DPS);
    } finally {
      const after = await moving.positions(device);
      const difference = (from: number | null, to: number | null) =>
        from === null || to === null ? null : to - from;
      setMoved({
        motorDeg: difference(before.position_deg, after.position_deg),
        bladeDeg: difference(before.blade_deg, after.blade_deg),
      });
    }
  };
  const sign = scale.trim().startsWith("-") ? -1 : 1;
  const read = fraction(scale.trim().replace(/^[-+]/, ""));
  // A person reads how far it went; which way is that of the move, unless a minus sign says otherwise.
  const way = Math.sign(moved?.motorDeg ?? 1) || 1;
  const scaleDeg = read === null ? null : sign * way * toNumber(read);
  return (
    <section
      className={`${axis.panel} ${axis.wide}`}
      aria-label={t("page.setup.gear.check")}
      data-testid="check-move"
    >
      <h2>{t("page.setup.gear.check")}</h2>
      <p>{t("page.setup.gear.check_explain", { degrees: MOVE_DEG, speed: SPEED_DPS })}</p>
      <div className={classes.steps}>
        <ControlSection device={device} />
        <Interlocks device={device} title={t("page.motion.interlocks")} />
        <PrepareSection device={device} />
        <section aria-label={t("page.setup.gear.check_run")}>
          <h3>{t("page.setup.gear.check_run")}</h3>
          <div className={motion.row}>
            <Select
              label={t("page.setup.gear.towards")}
              data={[
                { value: "minus", label: t("page.setup.gear.towards_zero") },
                { value: "plus", label: t("page.setup.gear.towards_feather") },
              ]}
              value={towards}
              onChange={(value) => value !== null && setTowards(value)}
              allowDeselect={false}
              w={180}
              data-testid="check-towards"
            />
            <RunButton
              hint={t("page.motion.hold")}
              disabled={!ready || busy}
              active={line?.running?.device === device && line.running.doing === "move"}
              onPress={() => order.mutate({ held: true, work: run })}
              testId="check-run"
            >
              {t("page.setup.gear.check_button", { degrees: MOVE_DEG })}
            </RunButton>
          </div>
          <TextInput
            label={t("page.setup.gear.scale")}
            description={t("page.setup.gear.scale_hint")}
            value={scale}
            onChange={(event) => setScale(event.currentTarget.value)}
            error={scale.trim() !== "" && read === null ? t("page.misfit.no_number") : null}
            rightSection="°"
            inputMode="decimal"
            disabled={moved === null}
            w={250}
            data-testid="scale"
          />
          <p data-testid="check-ended">
            {moved !== null &&
              line?.ended?.device === device &&
              `${t(`motion.doing.${line.ended.doing}`)}: ${t(`motion.ended.${line.ended.why}`)}`}
          </p>
          <OrderProblem error={order.error} title={t("page.motion.order_failed")} />
        </section>
      </div>
      {moved !== null && <Verdicts pmc={pmc} seen={{ ...moved, scaleDeg }} />}
      <p className={motion.plain}>{t("page.setup.gear.check_keeps_nothing")}</p>
    </section>
  );
}

function Verdicts({ pmc, seen }: { pmc: DeviceContext; seen: Witnessed }) {
  const t = useTexts();
  const degrees = (value: number | null) => (value === null ? "–" : `${figure(value, 2, t.language)}°`);
  const simulated = sideInUse(pmc) === BLADE;
  const short = Math.abs(seen.motorDeg ?? 0) < LEAST_MOVE_DEG;
  return (
    <div data-testid="check-result" role="status">
      <p>
        {t("page.setup.gear.seen", {
          motor: degrees(seen.motorDeg),
          blade: degrees(seen.bladeDeg),
          scale: degrees(seen.scaleDeg),
        })}
      </p>
      {simulated && <p className="tone-warning">{t("page.setup.gear.by_blade_encoder")}</p>}
      {short && <p className="tone-warning">{t("page.setup.gear.too_short", { least: LEAST_MOVE_DEG })}</p>}
      <ul className={classes.verdicts}>
        <Verdict name="encoders" said={seen.bladeDeg} moved={seen.motorDeg} gear={heldAt(pmc, BLADE.gear)} />
        {seen.scaleDeg !== null && (
          <>
            <Verdict
              name="motor"
              said={seen.motorDeg}
              moved={seen.scaleDeg}
              gear={heldAt(pmc, (simulated ? BLADE : MOTOR).gear)}
            />
            <Verdict name="blade" said={seen.bladeDeg} moved={seen.scaleDeg} gear={heldAt(pmc, BLADE.gear)} />
          </>
        )}
      </ul>
      {seen.scaleDeg === null && <p>{t("page.setup.gear.type_scale")}</p>}
    </div>
  );
}

interface VerdictProps {
  name: "encoders" | "motor" | "blade";
  said: number | null;
  moved: number | null;
  gear: Held | null;
}

const TONES: Readonly<Record<Agreement, string>> = {
  [Agreement.Agrees]: "ok",
  [Agreement.Off]: "error",
  [Agreement.Reversed]: "error",
  [Agreement.Unknown]: "none",
};

function Verdict({ name, said, moved, gear }: VerdictProps) {
  const t = useTexts();
  const { agreement, factor } = judge(said, moved);
  const number = (value: number | null, decimals: number) =>
    value === null ? "–" : figure(value, decimals, t.language);
  return (
    <li data-tone={TONES[agreement]} data-testid={`verdict-${name}`} data-verdict={agreement}>
      <strong>{t(`page.setup.gear.witness.${name}`)}</strong>{" "}
      {t(`page.setup.gear.agreement.${agreement}`, {
        said: number(said, 2),
        moved: number(moved, 2),
        factor: number(factor, 4),
        ratio: gear === null || factor === null ? "–" : number(ratioBy(gear, factor), 3),
        held: gear === null ? "–" : `${gear.above}/${gear.below}`,
      })}
    </li>
  );
}
