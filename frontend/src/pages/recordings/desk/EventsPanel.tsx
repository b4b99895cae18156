import { CloseButton, SegmentedControl, TextInput } from "@mantine/core";
import { IconAlertOctagon, IconAlertTriangle, IconFilter, IconInfoCircle } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useCallback, useDeferredValue, useMemo, useState, useSyncExternalStore } from "react";
import { type EventLine, eventsQuery } from "../../../api/replay";
import { FrameLink } from "../../../frame/FrameLink";
import { usePageSearch } from "../../../frame/search";
import { useStore } from "../../../live/live";
import { useLooking } from "../../../replay/looking";
import { useReplay } from "../../../replay/opening";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { useDeviceName } from "../../../ui/devices";
import { timeOfDay } from "../../../ui/format";
import { useTyped } from "../../../ui/useTyped";
import classes from "./Desk.module.css";
import { VirtualList } from "./VirtualList";

const ROW_PX = 44;
const LEAST = ["info", "warning", "error"] as const;
const LOOKS = {
  info: { Icon: IconInfoCircle, tone: "dim" },
  warning: { Icon: IconAlertTriangle, tone: "tone-warning" },
  error: { Icon: IconAlertOctagon, tone: "tone-error" },
};
const NOTHING: readonly EventLine[] = [];

interface Row {
  id: string;
  event: EventLine;
  text: string;
  device: string;
}

/** All that the devices told and that was noted, with the place of the cursor among it. */
export function EventsPanel({ replay }: { replay: string }) {
  const t = useTexts();
  const nameOf = useDeviceName();
  const looking = useLooking();
  const transport = useReplay()?.transport;
  const [search, update] = usePageSearch();
  const [typed, setTyped] = useTyped(search.find ?? "", (text) =>
    update({ find: text === "" ? undefined : text }),
  );
  const wanted = useDeferredValue(typed).trim().toLowerCase();
  const [least, setLeast] = useState<(typeof LEAST)[number]>("info");
  const events = useQuery(eventsQuery(replay));
  const lines = events.data ?? NOTHING;
  const all = useMemo(
    () =>
      lines.map((event, at): Row => {
        const text = t(event.text_key, event.details);
        return {
          id: `${event.t_ns} ${at}`,
          event,
          text: event.person === null ? text : t("page.events.by", { text, person: event.person }),
          device: event.device === null ? "–" : nameOf(event.device),
        };
      }),
    [lines, t, nameOf],
  );
  const rows = useMemo(
    () =>
      all.filter(
        ({ event, text, device }) =>
          LEAST.indexOf(event.severity) >= LEAST.indexOf(least) &&
          `${text} ${device}`.toLowerCase().includes(wanted),
      ),
    [all, least, wanted],
  );
  const now = usePlaceAmong(rows, "cursor");
  const near = usePlaceAmong(rows, "hover");
  return (
    <>
      <div className={classes.filter}>
        <TextInput
          aria-label={t("page.events.filter")}
          placeholder={t("page.events.filter")}
          leftSection={<IconFilter size={17} aria-hidden />}
          rightSectionWidth={40}
          rightSection={
            typed !== "" && (
              <CloseButton aria-label={t("page.table.clear_filter")} onClick={() => setTyped("")} />
            )
          }
          value={typed}
          onChange={(event) => setTyped(event.currentTarget.value)}
          data-testid="desk-event-filter"
        />
        <div className={classes.filterLine}>
          <SegmentedControl
            size="xs"
            value={least}
            onChange={(chosen) => setLeast(LEAST.find((one) => one === chosen) ?? "info")}
            data={LEAST.map((one) => ({ value: one, label: t(`page.events.least_${one}`) }))}
            aria-label={t("page.events.least")}
          />
          <span className="dim" data-testid="event-count">
            {t("page.table.count", { shown: rows.length, total: all.length })}
          </span>
        </div>
      </div>
      {events.isError && <ProblemAlert error={events.error} title={t("desk.events_failed")} />}
      <VirtualList
        label={t("page.events.label")}
        testId="desk-events"
        rows={rows}
        rowPx={ROW_PX}
        idOf={(row) => row.id}
        follow={now}
        onPick={(row) => transport?.seek(row.event.t_ns)}
        row={(row) => {
          const { Icon, tone } = LOOKS[row.event.severity];
          const place = rows.indexOf(row);
          return {
            props: {
              className: classes.event ?? "",
              title: row.text,
              "data-now": place === now,
              "data-near": place === near && near !== now,
              "data-testid": "desk-event",
              onPointerEnter: () => looking.setHover(row.event.t_ns),
              onPointerLeave: () => looking.setHover(null),
            },
            cells: (
              <>
                <Icon size={15} className={tone} aria-label={t(`page.severity.${row.event.severity}`)} />
                <div>
                  <div className={classes.eventHead}>
                    <span>{timeOfDay(row.event.t_ns / 1e6)}</span>
                    <span className="dim">{row.device}</span>
                    <FrameLink tNs={row.event.t_ns} />
                  </div>
                  <div className={classes.eventText}>{row.text}</div>
                </div>
              </>
            ),
          };
        }}
      />
    </>
  );
}

/** Index of the last row at or before the cursor; for the pointer that of the nearest. -1 where there is none. */
function usePlaceAmong(rows: readonly Row[], of: "cursor" | "hover"): number {
  const store = useStore();
  const looking = useLooking();
  const subscribe = useCallback(
    (listener: () => void) =>
      of === "cursor" ? store.subscribe("cursor", listener) : looking.subscribe("hover", listener),
    [store, looking, of],
  );
  return useSyncExternalStore(subscribe, () => {
    const tNs = of === "cursor" ? (store.cursor?.t_ns ?? null) : looking.hoverNs;
    if (tNs === null) return -1;
    const at = lastAt(rows, tNs);
    if (of === "cursor") return at;
    const [before, after] = [rows[at], rows[at + 1]];
    if (!after) return at;
    return before && tNs - before.event.t_ns <= after.event.t_ns - tNs ? at : at + 1;
  });
}

function lastAt(rows: readonly Row[], tNs: number): number {
  let [low, high] = [0, rows.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((rows[middle]?.event.t_ns ?? Infinity) <= tNs) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}
