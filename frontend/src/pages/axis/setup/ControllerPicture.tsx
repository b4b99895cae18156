import { SegmentedControl } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { runQuery, runsQuery, type SignalRun, type SignalSettings } from "../../../api/signals";
import { usePageSearch } from "../../../frame/search";
import { useShown } from "../../../live/live";
import { figure } from "../../../model/values";
import type { DeviceContext } from "../../../model/shown";
import motion from "../../../motion/Motion.module.css";
import { OrderProblem } from "../../../motion/OrderProblem";
import { RunButton } from "../../../motion/RunButton";
import { useTexts } from "../../../texts/texts";
import axis from "../Axis.module.css";
import { RecordedNote } from "../RecordedNote";
import type { Line } from "../signal/plotData";
import { ResponsePlot } from "../signal/ResponsePlot";
import { RunResults } from "../signal/RunResults";
import { durationS, USUAL } from "../signal/settings";
import { SettingsFields } from "../signal/SettingsFields";
import classes from "../signal/Signal.module.css";
import { useSignalRun } from "../signal/useSignalRun";
import { ControllerProposal } from "./ControllerProposal";
import { ControllerStructure } from "./ControllerStructure";
import type { PictureProps } from "./SetupTab";

const RESPONSE: readonly Line[] = [
  { of: "set_point", colour: "--hs-dim", dash: [2, 3], width: 1.5, angle: true },
  { of: "expected", colour: "--hs-warn", dash: [7, 4], width: 1.75, angle: true },
  { of: "position", colour: "--hs-accent", angle: true },
];
const SHAPES = ["step", "ramp"] as const;

/** The position controller: its structure in force, a measured response over the expected one, and a proposal. */
export function ControllerPicture({ pmc }: PictureProps) {
  const t = useTexts();
  const { recorded } = useShown();
  if (!pmc) return null;
  return (
    <div className={`${axis.panels} bench`} data-testid="controller">
      <section className={`${axis.panel} ${axis.wide}`} aria-label={t("page.setup.controller.structure")}>
        <h2>{t("page.setup.controller.structure")}</h2>
        <p>{t("page.setup.controller.explain")}</p>
        <ControllerStructure pmc={pmc} />
      </section>
      {recorded ? <RecordedNote part="controller" /> : <Measure pmc={pmc} />}
    </div>
  );
}

function Measure({ pmc }: { pmc: DeviceContext }) {
  const t = useTexts();
  const run = useShownRun(pmc.slug);
  return (
    <>
      <section className={`${axis.panel} ${axis.wide}`} aria-label={t("page.setup.controller.test")}>
        <h2>{t("page.setup.controller.test")}</h2>
        <p>{t("page.setup.controller.test_explain")}</p>
        <Test device={pmc.slug} />
      </section>
      <section className={`${axis.panel} ${axis.wide}`} aria-label={t("page.setup.controller.response")}>
        <h2>{t("page.setup.controller.response")}</h2>
        {run === undefined ? (
          <p className="dim">{t("page.setup.controller.no_run")}</p>
        ) : (
          <div className={classes.columns}>
            <ResponsePlot
              run={run}
              lines={RESPONSE}
              title={t("page.signal.plot.angle")}
              unit="°"
              height={240}
              leastSpan={0.2}
              testId="controller-response"
            />
            <RunResults run={run} />
          </div>
        )}
      </section>
      {run !== undefined && (
        <section className={`${axis.panel} ${axis.wide}`} aria-label={t("page.setup.controller.proposal")}>
          <h2>{t("page.setup.controller.proposal")}</h2>
          <ControllerProposal run={run} pmc={pmc} />
        </section>
      )}
    </>
  );
}

function Test({ device }: { device: string }) {
  const t = useTexts();
  const [settings, setSettings] = useState<SignalSettings>(USUAL.step);
  const signal = useSignalRun(device);
  return (
    <>
      <div className={motion.row}>
        <SegmentedControl
          value={settings.shape}
          onChange={(shape) => setSettings(USUAL[shape])}
          data={SHAPES.map((shape) => ({ value: shape, label: t(`page.signal.shape.${shape}`) }))}
          aria-label={t("page.signal.shape_choice")}
        />
        <SettingsFields settings={settings} onChange={setSettings} />
        <RunButton
          hint={t("page.signal.hold", { seconds: figure(durationS(settings), 1, t.language) })}
          disabled={!signal.ready || signal.busy}
          active={signal.active}
          onPress={() => signal.start(settings)}
          testId="controller-run"
        >
          {t("page.signal.run", { shape: t(`page.signal.shape.${settings.shape}`) })}
        </RunButton>
      </div>
      {!signal.ready && <p className="dim">{t("page.setup.controller.motion_tab")}</p>}
      <OrderProblem error={signal.error} title={t("page.signal.failed")} />
    </>
  );
}

/** The run of the address where it is a step or ramp of this axis, else the latest one. */
function useShownRun(device: string): SignalRun | undefined {
  const [{ run: chosen }] = usePageSearch();
  const runs = useQuery(runsQuery(device)).data ?? [];
  const fitting = runs.filter((one) => one.signal.shape !== "sine");
  const id = (fitting.find((one) => one.id === chosen) ?? fitting[0])?.id;
  return useQuery({ ...runQuery(id ?? ""), enabled: id !== undefined }).data;
}
