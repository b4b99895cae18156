import { useQuery } from "@tanstack/react-query";
import { lazy } from "react";
import { useTurbineQuery } from "../../api/queries";
import { useTexts } from "../../texts/texts";
import { TabbedRoom } from "../../ui/TabbedRoom";

/** Each comes when it is looked at. */
const TABS = {
  move: lazy(async () => ({ default: (await import("./AxisPage")).AxisPage })),
  setup: lazy(async () => ({ default: (await import("./setup/SetupTab")).SetupTab })),
  scope: lazy(async () => ({ default: (await import("./scope/ScopeTab")).ScopeTab })),
  pdo: lazy(async () => ({ default: (await import("./pdo/PdoTab")).PdoTab })),
};

/** The pictures of the set-up and the PDOs are those of the units of a blade. */
const OF_A_BENCH = { move: TABS.move, scope: TABS.scope };

/** What belongs to one tab. */
const OWN = [
  "span",
  "picture",
  "pdo",
  "review",
  "findings",
  "gear",
  "ae",
  "channels",
  "capture",
  "measure",
  "refs",
  "zoom",
  "cursors",
  "spectrum",
  "xy",
  "find",
  "order",
  "less",
] as const;

/** One axis: what it does and what moves it, what sets it up, and what measures it. */
export function AxisRoom() {
  const t = useTexts();
  const turbine = useQuery(useTurbineQuery()).data;
  const blades = !turbine || turbine.stations.some(({ blade }) => blade !== null);
  return (
    <TabbedRoom
      name="axis"
      label={t("page.axis.tab.label")}
      titleOf={(tab) => t(`page.axis.tab.${tab}`)}
      tabs={blades ? TABS : OF_A_BENCH}
      own={OWN}
    />
  );
}
