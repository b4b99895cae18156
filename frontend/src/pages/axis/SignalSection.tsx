import { SegmentedControl } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { runQuery, type SignalSettings } from "../../api/signals";
import { usePageSearch } from "../../frame/search";
import { useDerived } from "../../live/live";
import { figure } from "../../model/values";
import motion from "../../motion/Motion.module.css";
import { OrderProblem } from "../../motion/OrderProblem";
import { RunButton } from "../../motion/RunButton";
import { useTexts } from "../../texts/texts";
import { RunList } from "./signal/RunList";
import { RunPlots } from "./signal/RunPlots";
import { RunResults } from "./signal/RunResults";
import { durationS, reach, SHAPES, USUAL } from "./signal/settings";
import { SettingsFields } from "./signal/SettingsFields";
import classes from "./signal/Signal.module.css";
import { useSignalRun } from "./signal/useSignalRun";

/** A test signal in mode 8 while it is held, its measured response, and earlier runs to compare it with. */
export function SignalSection({ device }: { device: string }) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const [settings, setSettings] = useState<SignalSettings>(USUAL.sine);
  const signal = useSignalRun(device);
  const run = useQuery({ ...runQuery(search.run ?? ""), enabled: search.run !== undefined }).data;
  const over = useQuery({ ...runQuery(search.over ?? ""), enabled: search.over !== undefined }).data;
  return (
    <section className={classes.wide} aria-label={t("page.signal.title")} data-testid="signal">
      <h3>{t("page.signal.title")}</h3>
      <p>{t("page.signal.explain")}</p>
      <div className={motion.row}>
        <SegmentedControl
          value={settings.shape}
          onChange={(shape) => setSettings(USUAL[shape])}
          data={SHAPES.map((shape) => ({ value: shape, label: t(`page.signal.shape.${shape}`) }))}
          aria-label={t("page.signal.shape_choice")}
          data-testid="signal-shape"
        />
        <SettingsFields settings={settings} onChange={setSettings} />
      </div>
      <div className={motion.row}>
        <RunButton
          hint={t("page.signal.hold", { seconds: figure(durationS(settings), 1, t.language) })}
          disabled={!signal.ready || signal.busy}
          active={signal.active}
          onPress={() => signal.start(settings)}
          testId="signal-run"
        >
          {t("page.signal.run", { shape: t(`page.signal.shape.${settings.shape}`) })}
        </RunButton>
        <span className={motion.ended}>
          {signal.ready ? (
            <Reach device={device} settings={settings} />
          ) : (
            t(signal.own ? "page.signal.prepare_first" : "page.signal.control_first")
          )}
        </span>
      </div>
      <OrderProblem error={signal.error} title={t("page.signal.failed")} />
      {run?.device === device && (
        <div className={classes.columns} data-testid="signal-response">
          <RunPlots run={run} earlier={over} />
          <RunResults run={run} />
        </div>
      )}
      <h3>{t("page.signal.runs")}</h3>
      <RunList
        device={device}
        shown={search.run}
        over={search.over}
        onShow={(id) => update({ run: id, over: undefined })}
        onOver={(id) => update({ over: id })}
      />
    </section>
  );
}

/** The angles between which the signal would stay if it began here. */
function Reach({ device, settings }: { device: string; settings: SignalSettings }) {
  const t = useTexts();
  const deg = (number: number) => figure(number, 2, t.language);
  return useDerived(["axes"], (store) => {
    const axis = [...store.axes.values()].find((one) => device.startsWith(one.station));
    if (axis?.position_deg == null) return null;
    const [low, high] = reach(settings, axis.position_deg);
    return t("page.signal.reach", { low: deg(low), high: deg(high) });
  });
}
