import { Tabs } from "@mantine/core";
import { usePageSearch } from "../../frame/search";
import { Unconnected } from "../../frame/Unconnected";
import { useBench } from "../../live/live";
import { useTexts } from "../../texts/texts";
import classes from "./Bus.module.css";
import { EmcyLog } from "./EmcyLog";
import { NO_VIEW } from "./filter";
import { IdentifierTable } from "./IdentifierTable";
import { LineView } from "./LineView";
import { LoadView } from "./LoadView";
import { NodeTable } from "./NodeTable";
import { SdoLog } from "./SdoLog";
import { TraceView } from "./TraceView";

const VIEWS = {
  trace: TraceView,
  ids: IdentifierTable,
  nodes: NodeTable,
  sdo: SdoLog,
  emcy: EmcyLog,
  load: LoadView,
  line: LineView,
};
type ViewName = keyof typeof VIEWS;

const isView = (name: string | undefined | null): name is ViewName => name != null && name in VIEWS;

/** Everything that crosses the bus: frame by frame, and in tables. */
export function BusPage() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const bench = useBench();
  const name: ViewName = isView(search.tab) ? search.tab : "trace";
  const View = VIEWS[name];
  return (
    <div className={classes.page}>
      <Tabs
        value={name}
        onChange={(to) => update({ ...NO_VIEW, tab: isView(to) && to !== "trace" ? to : undefined })}
        aria-label={t("trace.tab.label")}
      >
        <Tabs.List>
          {Object.keys(VIEWS).map((one) => (
            <Tabs.Tab key={one} value={one} h={40} data-testid={`tab-${one}`}>
              {t(`trace.tab.${one}`)}
            </Tabs.Tab>
          ))}
        </Tabs.List>
      </Tabs>
      {bench !== null && (bench.turbine === null ? <Unconnected /> : <View />)}
    </div>
  );
}
