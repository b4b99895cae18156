import { ActionIcon, SegmentedControl, TextInput, Tooltip } from "@mantine/core";
import {
  IconAlertOctagon,
  IconAlertTriangle,
  IconArrowsVertical,
  IconChevronDown,
  IconChevronUp,
  IconDownload,
  IconInfoCircle,
} from "@tabler/icons-react";
import { memo } from "react";
import type { EventData } from "../api/types";
import { useEvents } from "../live/live";
import type { NumberedEvent } from "../live/store";
import { csvOf, download } from "../ui/export";
import { type Translate, useTexts } from "../texts/texts";
import { useDeviceName } from "../ui/devices";
import { timeOfDay } from "../ui/format";
import { FrameLink } from "./FrameLink";
import classes from "./Frame.module.css";
import { usePageSearch } from "./search";

const SEVERITY_ICONS = { info: IconInfoCircle, warning: IconAlertTriangle, error: IconAlertOctagon };
const SEVERITY_TONES = { info: "dim", warning: "tone-warning", error: "tone-error" };

/** From which severity on events are shown; the order is that of urgency. */
const LEAST = ["info", "warning", "error"] as const;
const TALL = "tall";

/** What happened, and who did it where somebody here did. */
function textOf({ text_key, details, person }: EventData, t: Translate): string {
  const text = t(text_key, details);
  return person === null ? text : t("page.events.by", { text, person });
}

/** What happened, newest first; closed it still shows the newest. */
export const EventDrawer = memo(function EventDrawer() {
  const t = useTexts();
  const events = useEvents();
  const nameOf = useDeviceName();
  const [search, update] = usePageSearch();
  const open = search.events === "open";
  const latest = events[0];
  return (
    <section className={classes.events} aria-label={t("page.events.label")}>
      <button
        type="button"
        className={classes.eventBar}
        aria-expanded={open}
        data-testid="events-toggle"
        onClick={() => update({ events: open ? undefined : "open" })}
      >
        {open ? <IconChevronDown size={18} aria-hidden /> : <IconChevronUp size={18} aria-hidden />}
        <strong>{t("page.events.title", { count: events.length })}</strong>
        {!open && latest && (
          <span className={`${classes.eventLatest} bench`}>
            <span className="dim">{timeOfDay(latest.t_ns / 1e6)}</span>
            <Severity severity={latest.severity} />
            <span className="dim">{latest.device === null ? "–" : nameOf(latest.device)}</span>
            <span className={classes.ellipsis}>{textOf(latest, t)}</span>
          </span>
        )}
      </button>
      {open && <EventTable events={events} />}
    </section>
  );
});

function Severity({ severity }: { severity: EventData["severity"] }) {
  const t = useTexts();
  const Icon = SEVERITY_ICONS[severity];
  return (
    <span className={`${classes.severity} ${SEVERITY_TONES[severity]}`}>
      <Icon size={15} aria-hidden />
      {t(`page.severity.${severity}`)}
    </span>
  );
}

function EventTable({ events }: { events: readonly NumberedEvent[] }) {
  const t = useTexts();
  const nameOf = useDeviceName();
  const [search, update] = usePageSearch();
  const least = LEAST.find((one) => one === search.severity) ?? "info";
  const wanted = (search.eventq ?? "").trim().toLowerCase();
  const shown = events
    .filter((event) => LEAST.indexOf(event.severity) >= LEAST.indexOf(least))
    .map((event) => ({
      event,
      text: textOf(event, t),
      device: event.device === null ? "–" : nameOf(event.device),
    }))
    .filter((line) => `${line.text} ${line.device}`.toLowerCase().includes(wanted));
  const lines = () => [
    ["time", "severity", "device", "text"].map((one) => t(`page.events.${one}`)),
    ...shown.map(({ event, text, device }) => [
      new Date(event.t_ns / 1e6).toISOString(),
      t(`page.severity.${event.severity}`),
      device,
      text,
    ]),
  ];
  return (
    <div className={`${classes.eventBody} bench`} data-tall={search.drawer === TALL}>
      <table className={classes.eventTable}>
        <thead>
          <tr>
            <th className={classes.eventTime}>{t("page.events.time")}</th>
            <th className={classes.eventSeverity}>{t("page.events.severity")}</th>
            <th className={classes.eventDevice}>{t("page.events.device")}</th>
            <th>
              <div className={classes.eventTools}>
                <TextInput
                  className={classes.eventFilter ?? ""}
                  placeholder={t("page.events.filter")}
                  aria-label={t("page.events.filter")}
                  value={search.eventq ?? ""}
                  onChange={(event) => update({ eventq: event.currentTarget.value })}
                  data-testid="event-filter"
                />
                <SegmentedControl
                  size="xs"
                  value={least}
                  onChange={(chosen) => update({ severity: chosen === "info" ? undefined : chosen })}
                  data={LEAST.map((one) => ({ value: one, label: t(`page.events.least_${one}`) }))}
                  aria-label={t("page.events.least")}
                  data-testid="event-severity"
                />
                <Tooltip label={t("page.events.taller")}>
                  <ActionIcon
                    aria-label={t("page.events.taller")}
                    aria-pressed={search.drawer === TALL}
                    onClick={() => update({ drawer: search.drawer === TALL ? undefined : TALL })}
                    data-testid="event-taller"
                  >
                    <IconArrowsVertical size={17} aria-hidden />
                  </ActionIcon>
                </Tooltip>
                <Tooltip label={t("page.events.export")}>
                  <ActionIcon
                    aria-label={t("page.events.export")}
                    onClick={() => download("hubside-events.csv", csvOf(lines()))}
                    data-testid="event-export"
                  >
                    <IconDownload size={17} aria-hidden />
                  </ActionIcon>
                </Tooltip>
              </div>
            </th>
          </tr>
        </thead>
        <tbody>
          {shown.map(({ event, text, device }) => (
            <tr key={event.id}>
              <td>{timeOfDay(event.t_ns / 1e6)}</td>
              <td>
                <Severity severity={event.severity} />
              </td>
              <td>{device}</td>
              <td>
                {text} <FrameLink tNs={event.t_ns} />
              </td>
            </tr>
          ))}
          {shown.length === 0 && (
            <tr>
              <td colSpan={4} className="dim">
                {t(events.length === 0 ? "page.events.none" : "page.events.none_match")}
              </td>
            </tr>
          )}
        </tbody>
      </table>
    </div>
  );
}
