import { type BusLoadLine, useBusLoad, useIdentifiers } from "../../api/trace";
import { figure, rateText } from "../../model/values";
import { useTexts } from "../../texts/texts";
import { placeName, useDeviceOfNode } from "./nodeNames";
import classes from "./Bus.module.css";
import { idText, serviceText } from "./lines";
import { LoadPlot } from "./LoadPlot";
import { nodeColours } from "./palette";
import { Share } from "./Share";

const SHOWN_IDS = 14;

/** Load of each bus second by second, and who makes it. */
export function LoadView() {
  const buses = useBusLoad();
  return (
    <div className={`${classes.loads} bench`} data-testid="load-view">
      {buses.map((bus) => (
        <OneBus key={bus.bus} bus={bus} />
      ))}
    </div>
  );
}

function OneBus({ bus }: { bus: BusLoadLine }) {
  const t = useTexts();
  const deviceOf = useDeviceOfNode();
  const ids = useIdentifiers().filter((one) => one.bus === bus.bus);
  const percent = (share: number) => `${figure(share * 100, 1, t.language)} %`;
  const nodes = Object.entries(bus.nodes).sort(([, a], [, b]) => b - a);
  const numbers = [...new Set(bus.seconds.flatMap((second) => Object.keys(second.nodes)))].map(Number);
  const colours = nodeColours(numbers);
  const last = bus.seconds.at(-1);
  const peak = Math.max(0, ...bus.seconds.map((second) => second.load));
  const top = ids.toSorted((a, b) => b.load - a.load).slice(0, SHOWN_IDS);
  return (
    <section className={classes.load}>
      <header>
        <strong>{t("trace.load.bus", { bus: bus.bus, kbit: rateText(bus.bitrate, t.language) })}</strong>
        <span>
          {t("trace.load.now")} <b data-testid="load-now">{percent(bus.load)}</b>
        </span>
        <span>
          {t("trace.load.peak")} <b>{percent(peak)}</b>
        </span>
        <span>
          <b>{last?.frames ?? "–"}</b> {t("trace.load.frames")}
        </span>
      </header>
      <h3>{t("trace.load.history")}</h3>
      <LoadPlot seconds={bus.seconds} colours={colours} label={t("trace.load.history")} />
      <div className={classes.shares}>
        <div>
          <h3>{t("trace.load.by_node")}</h3>
          <ul data-testid="load-nodes">
            {nodes.map(([node, share]) => (
              <li key={node}>
                <i style={{ background: colours.get(Number(node)) ?? "var(--hs-dim)" }} aria-hidden />
                <span>{placeName(Number(node), deviceOf, t)}</span>
                <Share share={share} most={nodes[0]?.[1] ?? 1} text={percent(share)} />
              </li>
            ))}
          </ul>
        </div>
        {top.length > 0 && (
          <div>
            <h3>{t("trace.load.by_id")}</h3>
            <ul>
              {top.map((one) => (
                <li key={idText(one)}>
                  <i style={{ background: colours.get(one.node) ?? "var(--hs-dim)" }} aria-hidden />
                  <span>
                    <b>{idText(one)}</b> {serviceText(one, t)} {one.node > 0 && one.node}
                  </span>
                  <Share share={one.load} most={top[0]?.load ?? 1} text={percent(one.load)} />
                </li>
              ))}
            </ul>
          </div>
        )}
      </div>
    </section>
  );
}
