import {
  type Icon,
  IconAdjustmentsHorizontal,
  IconChecklist,
  IconFiles,
  IconLayoutDashboard,
  IconMovie,
  IconRotateClockwise2,
  IconSchool,
  IconSettings,
  IconTopologyBus,
} from "@tabler/icons-react";
import { Link } from "@tanstack/react-router";
import { memo } from "react";
import { useLiveInstructor } from "../live/live";
import { useTexts } from "../texts/texts";
import classes from "./Frame.module.css";
import { INSTRUCTOR, type RoomPath, ROOMS } from "./rooms";
import { roomSearch } from "./search";

const ICONS: Record<RoomPath, Icon> = {
  "/": IconLayoutDashboard,
  "/axis": IconRotateClockwise2,
  "/parameters": IconAdjustmentsHorizontal,
  "/sets": IconFiles,
  "/recordings": IconMovie,
  "/bus": IconTopologyBus,
  "/procedures": IconChecklist,
  "/settings": IconSettings,
  "/instructor": IconSchool,
};

/** The rooms; the device and the blade that one is about go along. */
export const Navigation = memo(function Navigation() {
  const t = useTexts();
  const liveInstructor = useLiveInstructor();
  const ours = liveInstructor?.available === true;
  const rooms = ROOMS.filter(({ path }) => ours || path !== INSTRUCTOR);
  return (
    <nav className={classes.rooms} aria-label={t("page.rooms.label")}>
      {rooms.map(({ path, name }) => {
        const RoomIcon = ICONS[path];
        return (
          <Link
            key={path}
            to={path}
            search={roomSearch}
            className={classes.room}
            data-twin={path === INSTRUCTOR}
            activeOptions={{ exact: true, includeSearch: false }}
          >
            <RoomIcon size={22} aria-hidden />
            {t(`page.rooms.${name}`)}
          </Link>
        );
      })}
    </nav>
  );
});
