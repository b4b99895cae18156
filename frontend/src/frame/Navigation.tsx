import {
  IconAdjustmentsHorizontal,
  IconChecklist,
  IconFiles,
  IconLayoutDashboard,
  IconMovie,
  IconRotateClockwise2,
  IconSettings,
  IconTopologyBus,
} from "@tabler/icons-react";
import { Link } from "@tanstack/react-router";
import { useTexts } from "../texts/texts";
import classes from "./Frame.module.css";
import { type PageSearch, readSearch } from "./search";

const ROOMS = [
  { to: "/", key: "overview", Icon: IconLayoutDashboard },
  { to: "/axis", key: "axis", Icon: IconRotateClockwise2 },
  { to: "/parameters", key: "parameters", Icon: IconAdjustmentsHorizontal },
  { to: "/sets", key: "sets", Icon: IconFiles },
  { to: "/recordings", key: "recordings", Icon: IconMovie },
  { to: "/bus", key: "bus", Icon: IconTopologyBus },
  { to: "/procedures", key: "procedures", Icon: IconChecklist },
  { to: "/settings", key: "settings", Icon: IconSettings },
] as const;

/** The rooms; the rest of the search, device and filter too, goes along. */
export function Navigation() {
  const t = useTexts();
  return (
    <nav className={classes.rooms} aria-label={t("page.rooms.label")}>
      {ROOMS.map(({ to, key, Icon }) => (
        <Link
          key={to}
          to={to}
          search={(before: PageSearch) => readSearch({ ...before, edit: undefined })}
          className={classes.room}
          activeOptions={{ exact: true, includeSearch: false }}
        >
          <Icon size={22} aria-hidden />
          {t(`page.rooms.${key}`)}
        </Link>
      ))}
    </nav>
  );
}
