import { IconWifiOff } from "@tabler/icons-react";
import { useHearing } from "../live/live";
import { useTexts } from "../texts/texts";
import { timeOfDay } from "../ui/format";
import classes from "./Frame.module.css";

/** Says plainly, within a second, that nothing shown is fresh. */
export function DeafBanner() {
  const t = useTexts();
  const hearing = useHearing();
  if (hearing.state !== "deaf") return null;
  const title =
    hearing.sinceMs === null
      ? t("page.deaf.never")
      : t("page.deaf.since", { time: timeOfDay(hearing.sinceMs, 0) });
  return (
    <div className={classes.deaf} role="alert" data-testid="deaf">
      <IconWifiOff size={20} aria-hidden />
      {title}
      <span>{t("page.deaf.explain")}</span>
    </div>
  );
}
