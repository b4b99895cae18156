import { Button } from "@mantine/core";
import { moving } from "../../api/motion";
import { Control, useControl } from "../../motion/lease";
import { useUnwatched } from "../../motion/axis";
import motion from "../../motion/Motion.module.css";
import { OrderProblem } from "../../motion/OrderProblem";
import { RunButton } from "../../motion/RunButton";
import { useOrder } from "../../motion/useOrder";
import { useTexts } from "../../texts/texts";

/** The drive is told to watch us, and proves that it stops without us; afterwards its old settings come back. `of`: whose texts. */
export function PrepareSection({ device, of = "motion" }: { device: string; of?: "motion" | "hydraulic" }) {
  const t = useTexts();
  const { motion: line, state } = useControl();
  const order = useOrder();
  const prepared = line?.prepared.find((one) => one.device === device);
  const left = line?.left.includes(device) === true;
  const unwatched = useUnwatched(device);
  const title = t(unwatched ? "page.motion.unwatched" : "page.motion.preparation");
  const running = line?.running?.device === device ? line.running.doing : null;
  return (
    <section aria-label={title}>
      <h3>{title}</h3>
      {left && <p className="tone-warning">{t("page.motion.left")}</p>}
      {unwatched ? (
        <p className={prepared ? "tone-warning" : undefined}>
          {t(`page.${of}.${prepared ? "unwatched_ready" : "unwatched_not_yet"}`)}
        </p>
      ) : (
        <p>
          {prepared ? t("page.motion.proven", { ms: prepared.proof_ms ?? "–" }) : t("page.motion.not_proven")}
        </p>
      )}
      <div className={motion.row}>
        {prepared || left ? (
          <Button
            variant="default"
            disabled={state !== Control.Own || line?.running != null}
            loading={order.isPending}
            onClick={() => order.mutate({ held: false, work: (one) => moving.putBack(device, one) })}
            data-testid="put-back"
          >
            {t("page.motion.put_back")}
          </Button>
        ) : (
          <RunButton
            hint={t("page.motion.hold")}
            disabled={state !== Control.Own || order.isPending || line?.running != null}
            active={running === "preparing"}
            onPress={() => order.mutate({ held: true, work: (one) => moving.prepare(device, one) })}
            testId="prepare"
          >
            {t("page.motion.prepare")}
          </RunButton>
        )}
      </div>
      {/* Below the button: it must not move away under the finger that holds it. */}
      <p data-testid="proof">
        {prepared
          ? t(unwatched ? "page.motion.unwatched_short" : "page.motion.is_proven")
          : running === "preparing"
            ? t("page.motion.proving")
            : ""}
      </p>
      <OrderProblem error={order.error} title={t("page.motion.prepare_failed")} />
    </section>
  );
}
