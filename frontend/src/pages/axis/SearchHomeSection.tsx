import { Select } from "@mantine/core";
import { useState } from "react";
import { moving } from "../../api/motion";
import type { DeviceContext } from "../../model/shown";
import { homingMethods } from "../../motion/axis";
import { Control, useControl } from "../../motion/lease";
import motion from "../../motion/Motion.module.css";
import { OrderProblem } from "../../motion/OrderProblem";
import { RunButton } from "../../motion/RunButton";
import { useOrder } from "../../motion/useOrder";
import { useTexts } from "../../texts/texts";
import { useReading } from "../../ui/reading";

const METHOD = "6098";

/** Some names begin with their number. */
const numbered = (value: number, name: string) => (name.startsWith(`${value}:`) ? name : `${value}: ${name}`);

/** Homing by a method of the drive's own, as long as it is held. */
export function SearchHomeSection({ device, context }: { device: string; context: DeviceContext | null }) {
  const t = useTexts();
  const { motion: line, state } = useControl();
  const order = useOrder();
  const inForce = useReading(context, METHOD, "kept");
  const [chosen, setChosen] = useState<string | null>(null);
  const ready = state === Control.Own && line?.prepared.some((one) => one.device === device) === true;
  const busy = order.isPending || line?.running != null;
  const method = chosen ?? (typeof inForce?.raw === "number" ? String(inForce.raw) : null);
  return (
    <section aria-label={t("page.motion.homing")}>
      <h3>{t("page.motion.homing")}</h3>
      <p>{t("page.motion.homing_explain")}</p>
      <div className={motion.row}>
        <Select
          label={t("page.motion.homing_method")}
          value={method}
          onChange={setChosen}
          data={homingMethods(context).map(({ value, text_key }) => ({
            value: String(value),
            label: numbered(value, t(text_key)),
          }))}
          allowDeselect={false}
          searchable
          w={320}
          data-testid="homing-method"
        />
        <RunButton
          hint={t("page.motion.homing_hint")}
          disabled={!ready || busy || method === null}
          active={line?.running?.device === device && line.running.doing === "homing"}
          onPress={() =>
            order.mutate({ held: true, work: (one) => moving.searchHome(device, one, Number(method)) })
          }
          testId="search-home"
        >
          {t("page.motion.homing_run")}
        </RunButton>
      </div>
      <OrderProblem error={order.error} title={t("page.motion.home_failed")} />
    </section>
  );
}
