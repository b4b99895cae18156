import { Tooltip } from "@mantine/core";
import { IconBug, IconPlayerPlay } from "@tabler/icons-react";
import { Link } from "@tanstack/react-router";
import { useInstructor } from "../live/live";
import { useTexts } from "../texts/texts";
import classes from "./Frame.module.css";
import { INSTRUCTOR } from "./rooms";
import { roomSearch } from "./search";

/** While faults act in the twins, or a scenario plays, every room says so: nobody is to take a twin for healthy. */
export function InstructorMark() {
  const t = useTexts();
  const line = useInstructor();
  if (!line?.available) return null;
  const { faults, playing } = line;
  if (faults.length === 0 && playing === null) return null;
  const count = faults.length;
  const names = [...new Set(faults.map(({ kind }) => t(`fault.${kind}.name`)))];
  const own = `scenario.${playing?.scenario ?? ""}.title`;
  const title = playing && (t.has(own) ? t(own) : playing.title);
  const plays = title === null ? [] : [t("page.instructor.plays", { title })];
  return (
    <Tooltip label={[...plays, ...names].join("\n")} style={{ whiteSpace: "pre-line" }}>
      <Link to={INSTRUCTOR} search={roomSearch} className={classes.injected} data-testid="injected">
        {playing === null ? <IconBug size={19} aria-hidden /> : <IconPlayerPlay size={19} aria-hidden />}
        <span className={classes.injectedText}>
          {playing !== null && <strong>{t("page.instructor.mark_plays")}</strong>}
          {count > 0 && (
            <strong>{t(count === 1 ? "page.instructor.mark_one" : "page.instructor.mark", { count })}</strong>
          )}
        </span>
        <span className={classes.injectedCount} aria-hidden>
          {count > 0 && count}
        </span>
      </Link>
    </Tooltip>
  );
}
