import { IconAdjustmentsHorizontal, IconLayoutDashboard } from "@tabler/icons-react";
import { Link } from "@tanstack/react-router";
import { useTexts } from "../texts/texts";
import classes from "./Frame.module.css";
import { type PageSearch, readSearch } from "./search";

const ROOMS = [
  { to: "/", key: "overview", Icon: IconLayoutDashboard },
  { to: "/parameters", key: "parameters", Icon: IconAdjustmentsHorizontal },
] as const;

/** The rooms that exist; the rest of the search, device and filter too, goes along. */
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
