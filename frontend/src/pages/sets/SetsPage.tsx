import { Tabs } from "@mantine/core";
import { lazy, Suspense } from "react";
import { type PageSearch, usePageSearch } from "../../frame/search";
import { useTexts } from "../../texts/texts";
import classes from "./SetsPage.module.css";

/** Each tab comes when it is looked at. */
const TABS = {
  library: lazy(async () => ({ default: (await import("./library/LibraryTab")).LibraryTab })),
  compare: lazy(async () => ({ default: (await import("./compare/CompareTab")).CompareTab })),
  blades: lazy(async () => ({ default: (await import("./parity/ParityTab")).ParityTab })),
  fleet: lazy(async () => ({ default: (await import("./fleet/FleetTab")).FleetTab })),
  restore: lazy(async () => ({ default: (await import("./restore/RestoreTab")).RestoreTab })),
  motors: lazy(async () => ({ default: (await import("./motors/MotorsTab")).MotorsTab })),
};
type TabName = keyof typeof TABS;

const isTab = (name: string | undefined | null): name is TabName => name != null && name in TABS;

/** What belongs to one tab and would mean something else, or nothing, in another. */
const NO_TAB = {
  tab: undefined,
  find: undefined,
  order: undefined,
  less: undefined,
  file: undefined,
  columns: undefined,
  rows: undefined,
  group: undefined,
  turbine: undefined,
  of: undefined,
  golden: undefined,
  station: undefined,
  sets: undefined,
  select: undefined,
  closed: undefined,
  edit: undefined,
  motor: undefined,
  restore: undefined,
} satisfies { [K in keyof PageSearch]?: undefined };

/** Parameter sets: kept, compared, restored; and the motors. */
export function SetsPage() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const name: TabName = isTab(search.tab) ? search.tab : "library";
  const Tab = TABS[name];
  return (
    <div className={classes.page}>
      <Tabs
        value={name}
        onChange={(to) => update({ ...NO_TAB, tab: isTab(to) && to !== "library" ? to : undefined })}
        aria-label={t("page.sets.tab.label")}
      >
        <Tabs.List>
          {Object.keys(TABS).map((one) => (
            <Tabs.Tab key={one} value={one} h={40} data-testid={`sets-tab-${one}`}>
              {t(`page.sets.tab.${one}`)}
            </Tabs.Tab>
          ))}
        </Tabs.List>
      </Tabs>
      <div className={classes.tab}>
        <Suspense>
          <Tab />
        </Suspense>
      </div>
    </div>
  );
}
