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
import { useTurbineQuery } from "../api/queries";
import type { LinkData, Mode, RecordingStatus } from "../api/types";
import { useHearing, useLink, useLoadHistory, useServerNow } from "../live/live";
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

export function TopBar() {
  const link = useLink();
  return (
    <header className={classes.top}>
      <ConnectMenu />
      <ModeBadge mode={link?.mode ?? "none"} connected={link?.state === "connected"} />
      <BusFacts link={link} />
      <RecordingLight link={link} />
      <InstructorMark />
      <div className={classes.spacer} />
      <ControlMark />
      <Tools />
      <UserMenu />
      <StopButtons />
    </header>
  );
}

const MODE_ICONS = {
  live: IconBroadcast,
  twin: IconCpu,
  none: IconPlugOff,
  deaf: IconWifiOff,
  replay: IconHistory,
};

function ModeBadge({ mode, connected }: { mode: Mode; connected: boolean }) {
  const t = useTexts();
  const deaf = useHearing().state === "deaf";
  const shown = deaf ? "deaf" : connected ? mode : "none";
  const Icon = MODE_ICONS[shown];
  return (
    <span className={classes.badge} data-mode={shown} data-testid="mode" role="status">
      <Icon size={19} aria-hidden />
      {t(`page.mode.${shown}`)}
      {shown === "twin" && <small>{t("page.mode.simulated")}</small>}
    </span>
  );
}

function BusFacts({ link }: { link: LinkData | null }) {
  const t = useTexts();
  const history = useLoadHistory();
  const turbine = useQuery(useTurbineQuery()).data;
  if (!link || link.state === "disconnected") return null;
  const connected = link.state === "connected";
  const hasRate = link.bitrate > 0;
  // What is much to a field bus is little to a network: its load is told more closely.
  const load = t("page.bus.load", {
    load: figure(link.load * 100, hasRate ? 0 : 1, t.language).padStart(2, " "),
  });
  return (
    <div className={`${classes.record} bench`} data-testid="bus">
      <div className={classes.facts}>
        <strong>{connected ? load : t(`page.link.${link.state}`)}</strong>
        <span className="dim">
          {hasRate
            ? t("page.bus.facts", { bus: link.bus, kbit: figure(link.bitrate / 1000, 0, t.language) })
            : t("page.bus.facts_network", { bus: link.bus, connection: turbine?.bus.interface ?? "" })}
        </span>
      </div>
      {connected && (
        <Sparkline
          values={history}
          max={hasRate ? 1 : NETWORK_LOAD}
          className={classes.sparkline ?? ""}
          label={t("page.bus.sparkline")}
        />
      )}
    </div>
  );
}

function RecordingLight({ link }: { link: LinkData | null }) {
  const t = useTexts();
  const nowMs = useServerNow(SECOND_MS);
  const recording = link?.recording;
  if (!recording || link.state === "disconnected") return null;
  const on = recording.state === "on";
  const ranMs = recording.since_ns === null ? 0 : nowMs - recording.since_ns / 1e6;
  const losing = recording.lost > 0;
  return (
    <Tooltip label={recordingTitle(recording, t)}>
      <div className={`${classes.record} bench`} data-testid="recording" tabIndex={0}>
        <span className={classes.light} data-on={on} aria-hidden />
        <div className={classes.facts}>
          <strong>
            {on
              ? t("page.recording.running", { clock: clock(ranMs) })
              : t(`page.recording.${recording.state}`)}
          </strong>
          <span className={losing ? "tone-error" : "dim"}>
            {losing && <IconAlertTriangle size={13} aria-hidden />}{" "}
            {t("page.recording.facts", {
              size: megabytes(recording.size_bytes, t.language),
              lost: recording.lost,
            })}
          </span>
        </div>
      </div>
    </Tooltip>
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
