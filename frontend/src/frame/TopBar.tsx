import { ActionIcon, Tooltip } from "@mantine/core";
import {
  IconAlertTriangle,
  IconBroadcast,
  IconCpu,
  IconHistory,
  IconLanguage,
  IconMoon,
  IconPlugOff,
  IconSun,
  IconWifiOff,
} from "@tabler/icons-react";
import { useComputedColorScheme } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { memo } from "react";
import { useTurbineQuery } from "../api/queries";
import type { RecordingStatus } from "../api/types";
import { useHearing, useLiveMode, useLoadHistory, useOfLink, useServerNow } from "../live/live";
import { figure } from "../model/values";
import { ControlMark } from "../motion/ControlMark";
import { type Translate, useTexts } from "../texts/texts";
import { Sparkline } from "../ui/Sparkline";
import { clock, megabytes } from "../ui/format";
import { ConnectMenu } from "./ConnectMenu";
import classes from "./Frame.module.css";
import { InstructorMark } from "./InstructorMark";
import { StopButtons } from "./StopButtons";
import { UserMenu } from "./UserMenu";
import { usePageSearch } from "./search";

const SECOND_MS = 1000;
/** The top of the sparkline on a network: more than that of it no drive's traffic takes. */
const NETWORK_LOAD = 0.01;

export const TopBar = memo(function TopBar() {
  return (
    <header className={classes.top}>
      <ConnectMenu />
      <ModeBadge />
      <BusFacts />
      <RecordingLight />
      <InstructorMark />
      <div className={classes.spacer} />
      <ControlMark />
      <Tools />
      <UserMenu />
      <StopButtons />
    </header>
  );
});

const MODE_ICONS = {
  live: IconBroadcast,
  twin: IconCpu,
  none: IconPlugOff,
  deaf: IconWifiOff,
  replay: IconHistory,
};

function ModeBadge() {
  const t = useTexts();
  const mode = useLiveMode();
  const deaf = useHearing().state === "deaf";
  const shown = deaf ? "deaf" : mode;
  const Icon = MODE_ICONS[shown];
  return (
    <span className={classes.badge} data-mode={shown} data-testid="mode" role="status">
      <Icon size={19} aria-hidden />
      {t(`page.mode.${shown}`)}
      {shown === "twin" && <small>{t("page.mode.simulated")}</small>}
    </span>
  );
}

function BusFacts() {
  const t = useTexts();
  const turbine = useQuery(useTurbineQuery()).data;
  const link = useOfLink((now) => now && { state: now.state, bus: now.bus, bitrate: now.bitrate });
  if (!link || link.state === "disconnected") return null;
  const connected = link.state === "connected";
  const hasRate = link.bitrate > 0;
  return (
    <div className={`${classes.record} bench`} data-testid="bus">
      <div className={classes.facts}>
        <strong>{connected ? <Load hasRate={hasRate} /> : t(`page.link.${link.state}`)}</strong>
        <span className="dim">
          {hasRate
            ? t("page.bus.facts", { bus: link.bus, kbit: figure(link.bitrate / 1000, 0, t.language) })
            : t("page.bus.facts_network", { bus: link.bus, connection: turbine?.bus.interface ?? "" })}
        </span>
      </div>
      {connected && <LoadLine max={hasRate ? 1 : NETWORK_LOAD} />}
    </div>
  );
}

/** What is much to a field bus is little to a network: its load is told more closely. */
function Load({ hasRate }: { hasRate: boolean }) {
  const t = useTexts();
  return useOfLink((link) =>
    t("page.bus.load", {
      load: figure((link?.load ?? 0) * 100, hasRate ? 0 : 1, t.language).padStart(2, " "),
    }),
  );
}

function LoadLine({ max }: { max: number }) {
  const t = useTexts();
  const history = useLoadHistory();
  return (
    <Sparkline
      values={history}
      max={max}
      className={classes.sparkline ?? ""}
      label={t("page.bus.sparkline")}
    />
  );
}

function RecordingLight() {
  const t = useTexts();
  const shown = useOfLink((link) =>
    link === null || link.state === "disconnected"
      ? null
      : { on: link.recording.state === "on", title: recordingTitle(link.recording, t) },
  );
  if (!shown) return null;
  return (
    <Tooltip label={shown.title}>
      <div className={`${classes.record} bench`} data-testid="recording" tabIndex={0}>
        <span className={classes.light} data-on={shown.on} aria-hidden />
        <div className={classes.facts}>
          <RecordingTime />
          <RecordingSize />
        </div>
      </div>
    </Tooltip>
  );
}

function RecordingTime() {
  const t = useTexts();
  const { state, since_ns } = useOfLink((link) => ({
    state: link?.recording.state ?? "off",
    since_ns: link?.recording.since_ns ?? null,
  }));
  const nowMs = useServerNow(SECOND_MS);
  const ranMs = since_ns === null ? 0 : nowMs - since_ns / 1e6;
  return (
    <strong>
      {state === "on" ? t("page.recording.running", { clock: clock(ranMs) }) : t(`page.recording.${state}`)}
    </strong>
  );
}

function RecordingSize() {
  const t = useTexts();
  const { losing, words } = useOfLink((link) => {
    const { size_bytes = 0, lost = 0 } = link?.recording ?? {};
    const size = megabytes(size_bytes, t.language);
    return { losing: lost > 0, words: t("page.recording.facts", { size, lost }) };
  });
  return (
    <span className={losing ? "tone-error" : "dim"}>
      {losing && <IconAlertTriangle size={13} aria-hidden />} {words}
    </span>
  );
}

/** The file, and why the recording stands still or is not whole. */
function recordingTitle(recording: RecordingStatus, t: Translate): string {
  const reason = recording.reason === null ? null : t(recording.reason);
  return [recording.file, reason].filter(Boolean).join("\n") || t(`page.recording.${recording.state}`);
}

function Tools() {
  const t = useTexts();
  const [, update] = usePageSearch();
  const scheme = useComputedColorScheme();
  const other = scheme === "dark" ? "light" : "dark";
  const language = t.language === "en" ? "de" : "en";
  return (
    <div className={classes.tools}>
      <Tooltip label={t("page.tools.language")}>
        <ActionIcon
          w={58}
          aria-label={`${language.toUpperCase()}: ${t("page.tools.language")}`}
          data-testid="language"
          onClick={() => update({ lang: language })}
        >
          <IconLanguage size={18} aria-hidden />
          <span style={{ marginLeft: 4, fontSize: 13, fontWeight: 600 }}>{language.toUpperCase()}</span>
        </ActionIcon>
      </Tooltip>
      <Tooltip label={t(`page.tools.${other}`)}>
        <ActionIcon
          aria-label={t(`page.tools.${other}`)}
          data-testid="theme"
          onClick={() => update({ theme: other })}
        >
          {scheme === "dark" ? <IconSun size={18} aria-hidden /> : <IconMoon size={18} aria-hidden />}
        </ActionIcon>
      </Tooltip>
    </div>
  );
}
