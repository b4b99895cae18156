import { Button } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { moving } from "../../api/motion";
import { sendUrgent } from "../../live/live";
import { Control, holding, useControl } from "../../motion/lease";
import motion from "../../motion/Motion.module.css";
import { OrderProblem } from "../../motion/OrderProblem";
import { useOrder } from "../../motion/useOrder";
import { useTexts } from "../../texts/texts";

/** What ends the motion of this one axis, whoever moves it, and what takes its fault away. */
export function EndSection({ device, title }: { device: string; title: string }) {
  const t = useTexts();
  const { motion: line, state } = useControl();
  const reset = useOrder();
  const halt = useMutation({ mutationFn: () => moving.halt(device, holding.fence ?? 0) });
  const stop = useMutation({ mutationFn: () => sendUrgent({ command: "stop", device }) });
  const own = state === Control.Own;
  return (
    <section aria-label={title}>
      <h3>{title}</h3>
      <div className={motion.row}>
        <Button color="red" onClick={() => stop.mutate()} data-testid="quick-stop">
          {t("page.motion.quick_stop")}
        </Button>
        <Button variant="default" disabled={!own} onClick={() => halt.mutate()} data-testid="halt">
          {t("page.motion.halt")}
        </Button>
        <Button
          variant="default"
          disabled={!own || reset.isPending || line?.running != null}
          onClick={() => reset.mutate({ held: false, work: (one) => moving.reset(device, one) })}
          data-testid="reset-fault"
        >
          {t("page.motion.reset")}
        </Button>
      </div>
      <p className="dim">{t("page.motion.end_explain")}</p>
      <OrderProblem error={reset.error} title={t("page.motion.order_failed")} />
      <OrderProblem error={halt.error} title={t("page.motion.halt_failed")} />
      <OrderProblem error={stop.error} title={t("page.motion.stop_failed")} />
    </section>
  );
}
