import { Button, Center, Loader } from "@mantine/core";
import { IconBroadcast, IconDoorExit, IconRefresh } from "@tabler/icons-react";
import type { ReactNode } from "react";
import { useQuery } from "@tanstack/react-query";
import { turbineQuery } from "../api/queries";
import { useTexts } from "../texts/texts";
import { ProblemAlert } from "../ui/ProblemAlert";
import { useLeaveReplay } from "./leaving";
import { useReplay } from "./opening";
import classes from "./Replay.module.css";

/** A room that shows the recording: once it is open, and what to do where it cannot be. */
export function RecordedRoom({ children }: { children: ReactNode }) {
  const t = useTexts();
  const replay = useReplay();
  const leave = useLeaveReplay();
  if (!replay || replay.doc) return children;
  if (replay.error === null)
    return (
      <Center h="60%">
        <Loader aria-label={t("page.replay.opening")} color="violet" />
      </Center>
    );
  return (
    <div className={classes.failed} data-testid="replay-failed">
      <ProblemAlert error={replay.error} title={t("page.replay.failed", { name: replay.id })} />
      <p>{t("page.replay.failed_next")}</p>
      <div>
        <Button variant="default" leftSection={<IconRefresh size={17} aria-hidden />} onClick={replay.again}>
          {t("page.replay.again")}
        </Button>
        <Button variant="default" leftSection={<IconDoorExit size={17} aria-hidden />} onClick={leave}>
          {t("page.replay.leave")}
        </Button>
      </div>
    </div>
  );
}

/** Above a room that is about the bench whatever the page shows. */
export function LiveRoomNote() {
  const t = useTexts();
  const turbine = useQuery(turbineQuery).data?.name;
  const leave = useLeaveReplay();
  return (
    <div className={classes.liveRoom} role="note" data-testid="live-room">
      <IconBroadcast size={18} aria-hidden />
      <span>
        <strong>
          {turbine === undefined ? t("page.replay.live_none") : t("page.replay.live_room", { turbine })}
        </strong>{" "}
        {t("page.replay.live_room_means")}
      </span>
      <Button variant="default" px="sm" onClick={leave}>
        {t("page.replay.leave")}
      </Button>
    </div>
  );
}
