import { Button, Checkbox, SegmentedControl } from "@mantine/core";
import { useState } from "react";
import { moving } from "../../api/motion";
import { useDeviceVersion } from "../../live/live";
import type { DeviceContext } from "../../model/shown";
import { Control, useControl } from "../../motion/lease";
import motion from "../../motion/Motion.module.css";
import { OrderProblem } from "../../motion/OrderProblem";
import { useOrder } from "../../motion/useOrder";
import { useTexts } from "../../texts/texts";

const AXIS_OPERATION = "0/53";
const SINGLE = 1;

/** Who drives the axis, and whether both cylinders go together; changed by the server in the order that the device wants. */
export function HydraulicOperation({ device, context }: { device: string; context: DeviceContext | null }) {
  const t = useTexts();
  const { motion: line, state } = useControl();
  const order = useOrder();
  useDeviceVersion(device);
  const [chosen, setChosen] = useState<boolean | null>(null);
  const [aligned, setAligned] = useState(false);
  const inForce = context?.lookup(AXIS_OPERATION);
  const single = chosen ?? inForce === SINGLE;
  const disabled = state !== Control.Own || line?.running != null || (!single && !aligned);
  return (
    <section aria-label={t("page.hydraulic.operation")}>
      <h3>{t("page.hydraulic.operation")}</h3>
      <p className="dim">{t("page.hydraulic.operation_explain")}</p>
      <SegmentedControl
        value={single ? "single" : "together"}
        onChange={(value) => {
          setChosen(value === "single");
          setAligned(false);
        }}
        data={[
          { value: "together", label: t("page.hydraulic.together") },
          { value: "single", label: t("page.hydraulic.single") },
        ]}
        aria-label={t("page.hydraulic.operation")}
        data-testid="axis-operation"
        size="md"
        fullWidth
      />
      {!single && (
        <Checkbox
          checked={aligned}
          onChange={(event) => setAligned(event.currentTarget.checked)}
          label={t("page.hydraulic.aligned")}
          data-testid="aligned"
          my={10}
        />
      )}
      <div className={motion.row}>
        <Button
          variant="default"
          disabled={disabled}
          loading={order.isPending}
          onClick={() =>
            order.mutate({ held: false, work: (one) => moving.operation(device, one, single, aligned) })
          }
          data-testid="take-over"
        >
          {t("page.hydraulic.take_over")}
        </Button>
      </div>
      <p className="dim">{t("page.hydraulic.open_loop")}</p>
      <OrderProblem error={order.error} title={t("page.motion.order_failed")} />
    </section>
  );
}
