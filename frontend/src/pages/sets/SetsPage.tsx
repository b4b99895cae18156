import { lazy } from "react";
import { useTexts } from "../../texts/texts";
import { TabbedRoom } from "../../ui/TabbedRoom";

/** Each tab comes when it is looked at. */
const TABS = {
  library: lazy(async () => ({ default: (await import("./library/LibraryTab")).LibraryTab })),
  compare: lazy(async () => ({ default: (await import("./compare/CompareTab")).CompareTab })),
  blades: lazy(async () => ({ default: (await import("./parity/ParityTab")).ParityTab })),
  fleet: lazy(async () => ({ default: (await import("./fleet/FleetTab")).FleetTab })),
  restore: lazy(async () => ({ default: (await import("./restore/RestoreTab")).RestoreTab })),
  motors: lazy(async () => ({ default: (await import("./motors/MotorsTab")).MotorsTab })),
};

/** What belongs to one tab. */
const OWN = [
  "find",
  "order",
  "less",
  "file",
  "columns",
  "rows",
  "group",
  "turbine",
  "of",
  "golden",
  "station",
  "sets",
  "select",
  "closed",
  "edit",
  "motor",
  "restore",
] as const;

/** Parameter sets: kept, compared, restored; and the motors. */
export function SetsPage() {
  const t = useTexts();
  return (
    <TabbedRoom
      name="sets"
      label={t("page.sets.tab.label")}
      titleOf={(tab) => t(`page.sets.tab.${tab}`)}
      tabs={TABS}
      own={OWN}
    />
  );
}
