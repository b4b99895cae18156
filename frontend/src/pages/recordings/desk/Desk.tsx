import { ActionIcon, Button, Tooltip } from "@mantine/core";
import { IconArrowsHorizontal, IconZoomIn, IconZoomOut } from "@tabler/icons-react";
import { useEffect, useMemo, useState } from "react";
import type { ReplayDoc } from "../../../api/replay";
import { usePageSearch } from "../../../frame/search";
import { useStore } from "../../../live/live";
import { useFollow, useLooking, useWindow } from "../../../replay/looking";
import { useReplay } from "../../../replay/opening";
import { windowOf, zoomed } from "../../../replay/timelineView";
import { useTexts } from "../../../texts/texts";
import classes from "./Desk.module.css";
import { EventsPanel } from "./EventsPanel";
import { FirstOut } from "./FirstOut";
import { Noted } from "./Noted";
import { Parameters } from "./Parameters";
import { useAgainst } from "./Differences";
import { PlotStack } from "./PlotStack";
import { SignalTree } from "./SignalTree";
import { type DeskSignal, useSignals } from "./signals";
import { type Plots, usePlots } from "./usePlots";
import { Views } from "./Views";

const TABS = ["first_out", "events", "signals", "parameters", "noted"] as const;
const ZOOM = 0.5;

/** The desk of a replay: why it tripped, what was told, every signal; and the plots of what is asked for. */
export function Desk() {
  const t = useTexts();
  const replay = useReplay();
  const doc = replay?.doc;
  const signals = useSignals(replay?.id ?? "");
  if (replay === null || doc === undefined) return <p className={classes.empty}>{t("page.loading")}</p>;
  return <DeskOf doc={doc} signals={signals ?? NO_SIGNALS} known={signals !== null} />;
}

const NO_SIGNALS: ReadonlyMap<string, DeskSignal> = new Map();

interface Props {
  doc: ReplayDoc;
  signals: ReadonlyMap<string, DeskSignal>;
  known: boolean;
}

function DeskOf({ doc, signals, known }: Props) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const plots = usePlots(signals);
  const tab = TABS.find((one) => one === search.tab) ?? "first_out";
  const otherNs = useAgainst().tNs;
  useWindowInUrl(doc);
  return (
    <div className={classes.desk} data-testid="desk">
      <section className={classes.panel} aria-label={t("desk.panel")}>
        <div className={classes.tabs} role="tablist" aria-label={t("desk.panel")}>
          {TABS.map((one) => (
            <button
              key={one}
              type="button"
              role="tab"
              aria-selected={one === tab}
              aria-controls="desk-panel"
              onClick={() => update({ tab: one === "first_out" ? undefined : one })}
              data-testid={`tab-${one}`}
            >
              {t(`desk.tab.${one}`)}
            </button>
          ))}
        </div>
        <div id="desk-panel" className={classes.body} role="tabpanel" aria-label={t(`desk.tab.${tab}`)}>
          {tab === "first_out" && <FirstOut replay={doc.id} />}
          {tab === "events" && <EventsPanel replay={doc.id} />}
          {tab === "signals" && <SignalTree signals={signals} plots={plots} />}
          {tab === "parameters" && <Parameters replay={doc.id} signals={signals} />}
          {tab === "noted" && <Noted doc={doc} />}
        </div>
      </section>
      <section className={classes.plots} aria-label={t("desk.plots")}>
        <Tools doc={doc} plots={plots} />
        {known ? (
          <PlotStack doc={doc} signals={signals} plots={plots} otherNs={otherNs} />
        ) : (
          <p className={classes.empty}>{t("desk.indexing")}</p>
        )}
      </section>
    </div>
  );
}

function Tools({ doc, plots }: { doc: ReplayDoc; plots: Plots }) {
  const t = useTexts();
  const store = useStore();
  const looking = useLooking();
  const window = useWindow();
  const follow = useFollow();
  const whole = useMemo(() => ({ fromNs: doc.from_ns, toNs: doc.to_ns }), [doc.from_ns, doc.to_ns]);
  const zoom = (factor: number) => {
    const view = looking.window ?? whole;
    const cursorNs = store.cursor?.t_ns ?? whole.fromNs;
    const inside = cursorNs >= view.fromNs && cursorNs <= view.toNs;
    const next = zoomed(view, whole, factor, inside ? cursorNs : (view.fromNs + view.toNs) / 2);
    looking.setWindow(windowOf(next, whole));
  };
  return (
    <div className={classes.tools} role="toolbar" aria-label={t("desk.tools")}>
      <Views plots={plots} />
      <span className={classes.hint} title={t("desk.hint")}>
        {t("desk.hint")}
      </span>
      <Button
        variant="default"
        aria-pressed={follow}
        onClick={() => looking.setFollow(!follow)}
        title={t("desk.follow_why")}
        data-testid="follow"
      >
        {t(follow ? "desk.follow_on" : "desk.follow_off")}
      </Button>
      <Tool label={t("desk.zoom_in")} onClick={() => zoom(ZOOM)} name="zoom-in">
        <IconZoomIn size={18} aria-hidden />
      </Tool>
      <Tool
        label={t("desk.zoom_out")}
        onClick={() => zoom(1 / ZOOM)}
        name="zoom-out"
        disabled={window === null}
      >
        <IconZoomOut size={18} aria-hidden />
      </Tool>
      <Tool
        label={t("desk.zoom_all")}
        onClick={() => looking.setWindow(null)}
        name="zoom-all"
        disabled={window === null}
      >
        <IconArrowsHorizontal size={18} aria-hidden />
      </Tool>
    </div>
  );
}

interface ToolProps {
  label: string;
  name: string;
  onClick: () => void;
  disabled?: boolean;
  children: React.ReactNode;
}

function Tool({ label, name, onClick, disabled = false, children }: ToolProps) {
  return (
    <Tooltip label={label}>
      <ActionIcon aria-label={label} onClick={onClick} disabled={disabled} data-testid={name}>
        {children}
      </ActionIcon>
    </Tooltip>
  );
}

const WRITTEN_AFTER_MS = 400;
const PLACES = 6;

/** Keeps the stretch in view in the URL, and shows that of a link. */
function useWindowInUrl(doc: ReplayDoc): void {
  const looking = useLooking();
  const [search, update] = usePageSearch();
  const [linked] = useState(search.window);
  useEffect(() => {
    const match = /^([\d.]+)-([\d.]+)$/.exec(linked ?? "");
    const [from, to] = [Number(match?.[1]), Number(match?.[2])];
    if (from < to) looking.setWindow({ fromNs: doc.from_ns + from * 1e9, toNs: doc.from_ns + to * 1e9 });
    let timer: ReturnType<typeof setTimeout> | undefined;
    const write = () => {
      const { window } = looking;
      const seconds = (tNs: number) => String(Number(((tNs - doc.from_ns) / 1e9).toFixed(PLACES)));
      update({ window: window === null ? undefined : `${seconds(window.fromNs)}-${seconds(window.toNs)}` });
    };
    const end = looking.subscribe("window", () => {
      clearTimeout(timer);
      timer = setTimeout(write, WRITTEN_AFTER_MS);
    });
    return () => {
      end();
      clearTimeout(timer);
    };
  }, [doc.from_ns, looking, linked, update]);
}
