import {
  IconInfoCircle,
  IconLanguage,
  IconPlugConnected,
  IconRefreshDot,
  IconShieldLock,
  IconTopologyStar3,
  IconUsers,
} from "@tabler/icons-react";
import { Link } from "@tanstack/react-router";
import type { ReactNode } from "react";
import { type PageSearch, readSearch, usePageSearch } from "../../frame/search";
import { useTexts } from "../../texts/texts";
import { AboutSection } from "./AboutSection";
import { AdaptersSection } from "./AdaptersSection";
import { AuditSection } from "./AuditSection";
import { LanguageSection } from "./LanguageSection";
import { PollingSection } from "./PollingSection";
import classes from "./Settings.module.css";
import { TurbinesSection } from "./TurbinesSection";
import { UsersSection } from "./UsersSection";

const SECTIONS = [
  { id: "buses", Icon: IconPlugConnected, Section: AdaptersSection },
  { id: "turbines", Icon: IconTopologyStar3, Section: TurbinesSection },
  { id: "polling", Icon: IconRefreshDot, Section: PollingSection },
  { id: "language", Icon: IconLanguage, Section: LanguageSection },
  { id: "users", Icon: IconUsers, Section: UsersSection },
  { id: "audit", Icon: IconShieldLock, Section: AuditSection },
  { id: "about", Icon: IconInfoCircle, Section: AboutSection },
] as const;

/** The settings, one section at a time; which one is in the URL. */
export function SettingsPage() {
  const t = useTexts();
  const [search] = usePageSearch();
  const shown = SECTIONS.find((one) => one.id === search.section) ?? SECTIONS[0];
  return (
    <div className={classes.page}>
      <nav className={classes.sections} aria-label={t("page.settings.label")}>
        {SECTIONS.map(({ id, Icon }) => (
          <Link
            key={id}
            to="/settings"
            search={(before: PageSearch) => readSearch({ ...before, section: id })}
            className={classes.section}
            aria-current={id === shown.id ? "page" : undefined}
            data-testid={`section-${id}`}
          >
            <Icon size={20} aria-hidden />
            {t(`page.settings.section.${id}`)}
          </Link>
        ))}
      </nav>
      <div className={classes.body} data-testid={`settings-${shown.id}`}>
        <Heading title={t(`page.settings.section.${shown.id}`)}>
          {t(`page.settings.lead.${shown.id}`)}
        </Heading>
        <shown.Section />
      </div>
    </div>
  );
}

function Heading({ title, children }: { title: string; children: ReactNode }) {
  return (
    <header>
      <h1>{title}</h1>
      <p className={classes.lead}>{children}</p>
    </header>
  );
}
