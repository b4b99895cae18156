import { Button } from "@mantine/core";
import { IconBolt } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { battery } from "../../../../api/battery";
import { NeedsRole } from "../../../../frame/NeedsRole";
import { useShown } from "../../../../live/live";
import type { DeviceContext } from "../../../../model/shown";
import { useTexts } from "../../../../texts/texts";
import { ProblemAlert } from "../../../../ui/ProblemAlert";
import { ReadingText } from "../../../../ui/ReadingText";
import { useReading } from "../../../../ui/reading";
import axis from "../../Axis.module.css";
import classes from "./Battery.module.css";
import { ChargeStage, stageOf } from "./blocs";
import { Fact } from "./BatteryFacts";

const STAGES = [ChargeStage.Off, ChargeStage.Current, ChargeStage.Voltage, ChargeStage.Full];

/** What the charger does, as the sequence that a charge goes through. */
export function ChargerPanel({ pmm }: { pmm: DeviceContext }) {
  const t = useTexts();
  const { recorded } = useShown();
  const number = (raw: unknown) => (typeof raw === "number" ? raw : null);
  const status = number(useReading(pmm, "3001", "rare")?.raw);
  const offLoad = number(useReading(pmm, "3067", "rare")?.raw);
  const recharge = number(useReading(pmm, "30F1:05", "kept")?.raw);
  const now = stageOf(status, offLoad, recharge);
  const start = useMutation({ mutationFn: () => battery.charge(pmm.slug) });
  const resting = now === ChargeStage.Off || now === ChargeStage.Full;
  return (
    <section className={axis.panel} aria-label={t("page.setup.battery.charger")}>
      <h2>{t("page.setup.battery.charger")}</h2>
      <ol className={classes.sequence} data-testid="charger">
        {STAGES.map((one) => (
          <li key={one} {...(one === now ? { "aria-current": "step" as const } : {})}>
            {one === now ? "●" : "○"} {t(`page.setup.battery.stage.${one}`)}
          </li>
        ))}
      </ol>
      <dl className={classes.facts}>
        <Fact name={t("page.setup.battery.charger_status")}>
          <ReadingText context={pmm} address="3001" pace="rare" />
        </Fact>
        <Fact name={t("page.setup.battery.charger_v")}>
          <ReadingText context={pmm} address="3064" pace="rare" />
        </Fact>
        <Fact name={t("page.setup.battery.charger_a")}>
          <ReadingText context={pmm} address="3074" pace="rare" />
        </Fact>
      </dl>
      {!recorded && (
        <NeedsRole role="technician" device>
          {(locked) => (
            <Button
              variant="default"
              leftSection={<IconBolt size={17} aria-hidden />}
              disabled={locked || !resting}
              loading={start.isPending}
              onClick={() => start.mutate()}
              data-testid="start-charger"
            >
              {t("page.setup.battery.start_charger")}
            </Button>
          )}
        </NeedsRole>
      )}
      {start.error !== null && (
        <ProblemAlert error={start.error} title={t("page.setup.battery.start_charger_failed")} />
      )}
    </section>
  );
}
