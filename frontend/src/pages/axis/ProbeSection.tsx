import { Button } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { type Probe, probeQuery, signals } from "../../api/signals";
import { useRole } from "../../frame/role";
import { figure } from "../../model/values";
import motion from "../../motion/Motion.module.css";
import { OrderProblem } from "../../motion/OrderProblem";
import { type Translate, useTexts } from "../../texts/texts";
import { timeOfDay } from "../../ui/format";
import classes from "./signal/Signal.module.css";

/** The touch probe X4.7: where the drive captured its position, and what is new since it was armed. */
export function ProbeSection({ device }: { device: string }) {
  const t = useTexts();
  const [open, setOpen] = useState(false);
  return (
    <section className={classes.wide} aria-label={t("page.probe.title")} data-testid="probe">
      <h3>{t("page.probe.title")}</h3>
      <p>{t("page.probe.explain")}</p>
      <Button
        variant="default"
        h={40}
        aria-expanded={open}
        onClick={() => setOpen(!open)}
        data-testid="probe-open"
      >
        {t(open ? "page.probe.close" : "page.probe.open")}
      </Button>
      {open && <Captures device={device} />}
    </section>
  );
}

function Captures({ device }: { device: string }) {
  const t = useTexts();
  const { may, why } = useRole();
  const client = useQueryClient();
  const query = probeQuery(device);
  const { data: probe, error } = useQuery(query);
  const arm = useMutation({
    mutationFn: () => signals.armProbe(device),
    onSuccess: (line) => client.setQueryData(query.queryKey, line),
  });
  if (!probe) return <OrderProblem error={error} title={t("page.probe.failed")} />;
  const { rising_deg, falling_deg, armed_ns } = probe;
  const apart = rising_deg === null || falling_deg === null ? null : Math.abs(falling_deg - rising_deg);
  return (
    <>
      <div className={classes.probe}>
        <Edge of="rising" probe={probe} deg={rising_deg} tNs={probe.rising_ns} isNew={probe.rising_new} />
        <Edge of="falling" probe={probe} deg={falling_deg} tNs={probe.falling_ns} isNew={probe.falling_new} />
        <div className={classes.edge}>
          {t("page.probe.apart")}
          <strong data-testid="probe-apart">{angle(apart, t)}</strong>
          <span>
            {t("page.probe.input")}:{" "}
            {probe.level === null ? "–" : t(probe.level ? "page.probe.high" : "page.probe.low")}
          </span>
        </div>
      </div>
      <div className={motion.row}>
        <Button
          variant="default"
          h={40}
          disabled={!may("technician")}
          loading={arm.isPending}
          onClick={() => arm.mutate()}
          data-testid="probe-arm"
        >
          {t(armed_ns === null ? "page.probe.arm" : "page.probe.arm_again")}
        </Button>
        <span className={motion.ended} data-testid="probe-armed">
          {armed_ns === null
            ? t("page.probe.not_armed")
            : t("page.probe.armed", { time: timeOfDay(armed_ns / 1e6) })}
        </span>
        {why("technician") !== null && <span className="dim">{why("technician")}</span>}
      </div>
      <OrderProblem error={arm.error ?? error} title={t("page.probe.failed")} />
    </>
  );
}

interface EdgeProps {
  of: "rising" | "falling";
  probe: Probe;
  deg: number | null;
  tNs: number | null;
  isNew: boolean;
}

function Edge({ of, probe, deg, tNs, isNew }: EdgeProps) {
  const t = useTexts();
  const first = probe.first === of;
  return (
    <div className={classes.edge} data-first={first} data-new={isNew} data-testid={`probe-${of}`}>
      {t(`page.probe.${of}`)}
      <strong>{angle(deg, t)}</strong>
      <span>
        {tNs === null ? t("page.probe.before") : timeOfDay(tNs / 1e6)}
        {isNew && ` · ${t("page.probe.new")}`}
        {first && ` · ${t("page.probe.first", { angle: angle(probe.first_deg, t) })}`}
      </span>
    </div>
  );
}

const angle = (deg: number | null, t: Translate) => (deg === null ? "–" : `${figure(deg, 2, t.language)}°`);
