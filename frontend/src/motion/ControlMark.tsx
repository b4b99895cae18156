import { Tooltip } from "@mantine/core";
import { IconDeviceGamepad2 } from "@tabler/icons-react";
import { useServerNow } from "../live/live";
import { useTexts } from "../texts/texts";
import { clock } from "../ui/format";
import classes from "./Motion.module.css";
import { Control, useControl } from "./lease";

const SECOND_MS = 1000;

/** In the top bar of every room: who may move the axes, and for how long yet. */
export function ControlMark() {
  const t = useTexts();
  const { motion, state } = useControl();
  const holder = motion?.holder;
  if (!holder) return null;
  const own = state === Control.Own;
  return (
    <Tooltip label={t(own ? "page.motion.mark_own" : "page.motion.mark_others", { person: holder.person })}>
      <div className={classes.mark} data-own={own} data-testid="control" tabIndex={0}>
        <IconDeviceGamepad2 size={18} aria-hidden />
        <span>
          <strong>{own ? t("page.motion.you") : holder.person}</strong>{" "}
          <Left untilMs={holder.until_ns / 1e6} />
        </span>
      </div>
    </Tooltip>
  );
}

function Left({ untilMs }: { untilMs: number }) {
  const nowMs = useServerNow(SECOND_MS);
  return clock(Math.max(0, untilMs - nowMs)).replace(/^00:/, "");
}
