import { SegmentedControl } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { Problem } from "../../../api/client";
import { fleetQuery } from "../../../api/fleet";
import { knownDescriptionQuery } from "../../../api/sets";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import room from "../../../ui/Room.module.css";
import classes from "./Fleet.module.css";
import { FleetSentence } from "./FleetSentence";
import { GoldenPicker } from "./GoldenPicker";
import { goldenOf, useKinds } from "./golden";
import { HeatMap } from "./HeatMap";
import { fleetNames } from "./names";
import { ParameterRanking } from "./ParameterRanking";
import { Ranking } from "./Ranking";

enum View {
  Ranking = "ranking",
  Map = "map",
  Parameters = "parameters",
}

const LABEL = { minHeight: 40, display: "flex", alignItems: "center", justifyContent: "center" };

/** One golden set against the latest set of every device of its kind: who stands out, and where. */
export function FleetTab() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const kinds = useKinds();
  const { kind, record } = goldenOf(search.golden, kinds);
  const view = Object.values(View).find((one) => one === search.rows) ?? View.Ranking;
  const group = view === View.Map ? (search.group ?? null) : null;
  const query = useQuery(fleetQuery(kind, record, group));
  const description = useQuery({ ...knownDescriptionQuery(kind), enabled: kind !== "" }).data;
  const names = useMemo(() => fleetNames(description, t), [description, t]);
  const doc = kind === "" ? undefined : query.data;
  const unmarked = record === null && isUnmarked(query.error);
  const kindName = kinds.find((one) => one.id === kind)?.name ?? kind;
  return (
    <div className={classes.room}>
      <div className={classes.tools}>
        <GoldenPicker kinds={kinds} kind={kind} record={record} />
        <span className={classes.spacer} />
        {doc && (
          <SegmentedControl
            aria-label={t("page.fleet.view.label")}
            size="sm"
            styles={{ label: LABEL }}
            data={Object.values(View).map((value) => ({ value, label: t(`page.fleet.view.${value}`) }))}
            value={view}
            onChange={(rows) =>
              update({ rows: rows === View.Ranking ? undefined : rows, order: undefined, find: undefined })
            }
            data-testid="fleet-view"
          />
        )}
      </div>
      {kind === "" && <p>{t("page.fleet.nothing_known")}</p>}
      {unmarked && (
        <p className={room.note} data-testid="no-golden">
          {t("page.fleet.no_golden", { name: kindName })}
        </p>
      )}
      {query.isError && !unmarked && <ProblemAlert error={query.error} title={t("page.fleet.failed")} />}
      {doc && !query.isError && (
        <>
          <FleetSentence doc={doc} />
          {view === View.Ranking && <Ranking doc={doc} names={names} />}
          {view === View.Map && <HeatMap doc={doc} names={names} />}
          {view === View.Parameters && <ParameterRanking doc={doc} names={names} />}
        </>
      )}
    </div>
  );
}

/** True where no set of the kind was marked golden yet: nothing has failed, there is something to do. */
const isUnmarked = (error: Error | null): boolean =>
  error instanceof Problem && error.doc.details.reason_key === "compare.unresolved.no-golden";
