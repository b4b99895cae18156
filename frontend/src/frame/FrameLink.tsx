import { IconArrowUpRight } from "@tabler/icons-react";
import { Link } from "@tanstack/react-router";
import { digitsOf } from "../api/trace";
import { useTexts } from "../texts/texts";
import classes from "./Frame.module.css";
import { type PageSearch, roomSearch } from "./search";

/** From an event to the frame that told it, in the trace of the bus. */
export function FrameLink({ tNs }: { tNs: number }) {
  const t = useTexts();
  return (
    <Link
      to="/bus"
      search={(before: PageSearch) => roomSearch(before, { frame: digitsOf(tNs), paused: "1" })}
      className={classes.frameLink}
      title={t("trace.page.jump_hint")}
      data-testid="event-frame"
    >
      {t("trace.page.jump")}
      <IconArrowUpRight size={14} aria-hidden />
    </Link>
  );
}
