import { SegmentedControl } from "@mantine/core";
import { IconCpu, IconPlugOff } from "@tabler/icons-react";
import { Link } from "@tanstack/react-router";
import { roomSearch, usePageSearch } from "../../frame/search";
import { useInstructor } from "../../live/live";
import { useTexts } from "../../texts/texts";
import room from "../../ui/Room.module.css";
import { ActiveFaults } from "./ActiveFaults";
import { FaultCatalogue } from "./FaultCatalogue";
import classes from "./Instructor.module.css";
import { Scenarios } from "./Scenarios";

const SCENARIOS = "scenarios";

/** Faults and scenarios for the twins that the server has started. Nothing here ever reaches a real drive. */
export function InstructorPage() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const line = useInstructor();
  if (line === null) return null;
  if (!line.available) return <NotOurs />;
  const playing = search.tab === SCENARIOS;
  return (
    <div className={`${room.room} ${classes.page}`}>
      <div className={`${room.strip} ${classes.strip}`}>
        <h1>{t("page.rooms.instructor")}</h1>
        <SegmentedControl
          value={playing ? SCENARIOS : "faults"}
          onChange={(tab) => update({ tab: tab === SCENARIOS ? tab : undefined, find: undefined })}
          data={["faults", SCENARIOS].map((one) => ({ value: one, label: t(`page.instructor.tab.${one}`) }))}
          aria-label={t("page.instructor.tabs")}
          data-testid="instructor-tabs"
        />
        <span className={classes.only}>
          <IconCpu size={17} aria-hidden /> {t("page.instructor.only_twins")}
        </span>
      </div>
      <ActiveFaults line={line} />
      {playing ? <Scenarios line={line} /> : <FaultCatalogue answering={line.answering} />}
    </div>
  );
}

/** A link led here, but the turbine is none of our twins. */
function NotOurs() {
  const t = useTexts();
  return (
    <section className={classes.absent} data-testid="not-ours">
      <h2>
        <IconPlugOff size={22} aria-hidden /> {t("page.instructor.absent")}
      </h2>
      <p>{t("page.instructor.absent_why")}</p>
      <p>{t("page.instructor.absent_next")}</p>
      <Link to="/" search={roomSearch} className={room.link}>
        {t("page.not_found.back")}
      </Link>
    </section>
  );
}
