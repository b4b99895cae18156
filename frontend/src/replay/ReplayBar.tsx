import { ActionIcon, Button, Tooltip } from "@mantine/core";
import {
  IconArrowsHorizontal,
  IconDoorExit,
  IconHistory,
  IconPlayerPauseFilled,
  IconPlayerPlayFilled,
  IconPlayerSkipBack,
  IconPlayerSkipForward,
  IconPlayerTrackNext,
  IconPlayerTrackPrev,
  IconRepeat,
  IconChevronLeft,
  IconChevronRight,
  IconZoomReset,
} from "@tabler/icons-react";
import { type ReactNode, useState } from "react";
import type { ReplayDoc } from "../api/replay";
import type { CursorData } from "../api/types";
import { useCursor, useStore } from "../live/live";
import { useTexts } from "../texts/texts";
import { timeOfDay } from "../ui/format";
import { dateText, zoneText } from "./clockText";
import { useEarlier } from "./earlier";
import { FirstOutLine } from "./FirstOutLine";
import { KeyHelp } from "./KeyHelp";
import { useReplayKeys } from "./keys";
import { useLeaveReplay } from "./leaving";
import { useLooking, useWindow } from "./looking";
import { MarkMoment } from "./MarkMoment";
import { type Replay, useReplay } from "./opening";
import classes from "./Replay.module.css";
import { Speed } from "./Speed";
import { Timeline } from "./Timeline";
import type { Transport } from "./transport";

/** What moves a recording, in every room: whose it is and when, the transport, the clock, and the timeline. */
export function ReplayBar() {
  const t = useTexts();
  const replay = useReplay();
  const doc = replay?.doc;
  const leave = useLeaveReplay();
  if (!replay) return null;
  return (
    <section className={classes.bar} aria-label={t("page.replay.label")} data-testid="replay-bar">
      <div className={classes.row}>
        <Badge replay={replay} />
        {doc && <Controls doc={doc} replay={replay} />}
        <span className={classes.firstOut}>{doc && <FirstOutLine replay={doc.id} />}</span>
        {doc && <MarkMoment doc={doc} replay={replay} />}
        <Button
          variant="default"
          px="sm"
          className={classes.brief ?? ""}
          title={t("page.replay.leave")}
          leftSection={<IconDoorExit size={17} aria-hidden />}
          onClick={leave}
          aria-label={t("page.replay.leave")}
          data-testid="leave-replay"
        >
          {t("page.replay.leave_short")}
        </Button>
      </div>
      {doc && <Body doc={doc} replay={replay} />}
    </section>
  );
}

/** RECORDED, turbine, date: cannot be overlooked, whichever room it is. */
function Badge({ replay: { id, doc } }: { replay: Replay }) {
  const t = useTexts();
  const date = doc && dateText(doc.from_ns / 1e6);
  return (
    <div className={classes.badge} role="status" data-testid="replay-badge" title={doc?.recording ?? id}>
      <IconHistory size={19} aria-hidden />
      <strong>{t("page.mode.replay")}</strong>
      <span>
        {t("page.replay.recorded")}
        <b>{doc ? `${doc.name} · ${date ?? ""}` : id}</b>
      </span>
    </div>
  );
}

function Controls({ doc, replay }: { doc: ReplayDoc; replay: Replay }) {
  const t = useTexts();
  const cursor = useCursor() ?? doc.cursor;
  const { transport } = replay;
  const playing = cursor.playing;
  const label = t(playing ? "page.replay.pause" : "page.replay.play");
  return (
    <>
      <div className={classes.transport} role="group" aria-label={t("page.replay.transport")}>
        <Step
          name="event_back"
          icon={<IconPlayerTrackPrev size={18} />}
          on={() => transport.step("event", false)}
        />
        <Step name="time_back" icon={<IconPlayerSkipBack size={18} />} on={() => transport.stepTime(-1)} />
        <Step
          name="frame_back"
          icon={<IconChevronLeft size={18} />}
          on={() => transport.step("frame", false)}
        />
        <Tooltip label={`${label} · ${t("page.replay.key.space")}`}>
          <ActionIcon
            variant="filled"
            color="violet"
            w={52}
            aria-label={label}
            aria-keyshortcuts="Space"
            onClick={() => transport.toggle(cursor)}
            data-testid="play"
            data-playing={playing}
          >
            {playing ? (
              <IconPlayerPauseFilled size={20} aria-hidden />
            ) : (
              <IconPlayerPlayFilled size={20} aria-hidden />
            )}
          </ActionIcon>
        </Tooltip>
        <Step
          name="frame_on"
          icon={<IconChevronRight size={18} />}
          on={() => transport.step("frame", true)}
        />
        <Step name="time_on" icon={<IconPlayerSkipForward size={18} />} on={() => transport.stepTime(1)} />
        <Step
          name="event_on"
          icon={<IconPlayerTrackNext size={18} />}
          on={() => transport.step("event", true)}
        />
      </div>
      <Speed cursor={cursor} transport={transport} />
      <Clock cursor={cursor} />
    </>
  );
}

function Step({ name, icon, on }: { name: string; icon: ReactNode; on: () => void }) {
  const t = useTexts();
  const label = t(`page.replay.step.${name}`);
  return (
    <Tooltip label={label}>
      <ActionIcon aria-label={label} onClick={on} data-testid={`step-${name.replace("_", "-")}`}>
        {icon}
      </ActionIcon>
    </Tooltip>
  );
}

/** Date, milliseconds and zone of the cursor: nothing here is of today. */
function Clock({ cursor }: { cursor: CursorData }) {
  const ms = cursor.t_ns / 1e6;
  return (
    <div className={classes.clock} data-testid="replay-clock" data-ns={BigInt(cursor.t_ns).toString()}>
      <strong>{timeOfDay(ms)}</strong>
      <span>
        {dateText(ms)} {zoneText(ms)}
      </span>
    </div>
  );
}

/** Loop, zoom and help beside the timeline, and the offer of a link. */
function Body({ doc, replay }: { doc: ReplayDoc; replay: Replay }) {
  const t = useTexts();
  const store = useStore();
  const looking = useLooking();
  const zoomedIn = useWindow() !== null;
  const { transport } = replay;
  useEarlier(doc);
  const [selects, setSelects] = useState(false);
  const [help, setHelp] = useState(false);
  const looped = useCursor()?.loop != null;
  const toggleLoop = () => {
    if (looped) transport.setLoop(null);
    else setSelects((before) => !before);
  };
  useReplayKeys({
    store,
    transport,
    onLoop: toggleLoop,
    onLoopEnd: (end) => setLoopEnd(store.cursor, transport, end),
    onHelp: () => setHelp((before) => !before),
  });
  const loopLabel = t(looped ? "page.replay.loop_off" : "page.replay.loop_on");
  return (
    <div className={classes.row}>
      <div className={classes.side}>
        <Tooltip label={loopLabel}>
          <ActionIcon
            variant={looped ? "filled" : selects ? "light" : "default"}
            color="violet"
            aria-label={loopLabel}
            aria-pressed={looped || selects}
            onClick={toggleLoop}
            data-testid="loop"
          >
            {selects && !looped ? (
              <IconArrowsHorizontal size={18} aria-hidden />
            ) : (
              <IconRepeat size={18} aria-hidden />
            )}
          </ActionIcon>
        </Tooltip>
        <Tooltip label={t("page.replay.zoom_out")}>
          <ActionIcon
            aria-label={t("page.replay.zoom_out")}
            disabled={!zoomedIn}
            onClick={() => looking.setWindow(null)}
            data-testid="zoom-out"
          >
            <IconZoomReset size={18} aria-hidden />
          </ActionIcon>
        </Tooltip>
      </div>
      <Timeline
        doc={doc}
        transport={transport}
        selects={selects && !looped}
        onSelected={() => setSelects(false)}
      />
      <KeyHelp opened={help} onChange={setHelp} />
      {replay.offered !== null && <Offer replay={replay} tNs={replay.offered} />}
    </div>
  );
}

/** The link names a moment, but others look at this replay: theirs is not moved unasked. */
function Offer({ replay, tNs }: { replay: Replay; tNs: number }) {
  const t = useTexts();
  return (
    <div className={classes.offer} role="status" data-testid="moment-offer">
      <span>{t("page.replay.offer", { time: timeOfDay(tNs / 1e6) })}</span>
      <Button color="violet" onClick={() => replay.answerOffer(true)} data-testid="take-moment">
        {t("page.replay.offer_take")}
      </Button>
      <Button variant="default" onClick={() => replay.answerOffer(false)} data-testid="leave-moment">
        {t("page.replay.offer_leave")}
      </Button>
    </div>
  );
}

/** One end of the loop at the cursor; the other stays, or is the recording's. */
function setLoopEnd(cursor: CursorData | null, transport: Transport, end: "from" | "to"): void {
  if (!cursor) return;
  const { t_ns, loop, from_ns, to_ns } = cursor;
  const next =
    end === "from"
      ? { from_ns: t_ns, to_ns: loop && loop.to_ns > t_ns ? loop.to_ns : to_ns }
      : { from_ns: loop && loop.from_ns < t_ns ? loop.from_ns : from_ns, to_ns: t_ns };
  if (next.from_ns < next.to_ns) transport.setLoop(next);
}
