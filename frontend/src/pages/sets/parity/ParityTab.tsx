import { Loader } from "@mantine/core";
import { Unconnected } from "../../../frame/Unconnected";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import room from "../../../ui/Room.module.css";
import { Comparison } from "../compare/Comparison";
import { Against } from "../compare/marks";
import { Source } from "../compare/specs";
import { BladeVerdicts } from "./BladeVerdicts";
import { Chooser } from "./Chooser";
import classes from "./Parity.module.css";
import { useParity } from "./useParity";

/**
 * The blades of a turbine side by side, as they are now or by their latest sets: they should be alike but for what is
 * bound to one unit.
 */
export function ParityTab() {
  const t = useTexts();
  const [search] = usePageSearch();
  const parity = useParity();
  const { kinds, turbine, settled, error } = parity;
  const kind =
    kinds.find((one) => search.device !== undefined && one.devices.includes(search.device)) ?? kinds[0];
  if (!settled) return <Loader aria-label={t("page.loading")} />;
  if (parity.turbines.length === 0 && turbine === undefined) return <Unconnected />;
  if (!kind)
    return (
      <>
        <div className={classes.bar}>
          <Chooser parity={parity} />
        </div>
        {error === null || error === undefined ? (
          <p className={room.note} data-testid="parity-none">
            {t(noneKey(parity))}
          </p>
        ) : (
          <ProblemAlert error={error} title={t("page.compare.failed")} />
        )}
      </>
    );
  return (
    <Comparison
      key={`${turbine ?? ""} ${parity.source} ${kind.descriptionId}`}
      label={t("page.sets.tab.blades")}
      columns={kind.columns}
      against={Against.Majority}
      chooser={() => <Chooser parity={parity} kind={kind} />}
      verdict={(compared) => <BladeVerdicts compared={compared} without={kind.without} />}
    />
  );
}

function noneKey({ turbine, source }: ReturnType<typeof useParity>): string {
  if (turbine === undefined) return "page.parity.choose";
  return source === Source.Latest ? "page.parity.no_sets" : "page.parity.alone";
}
