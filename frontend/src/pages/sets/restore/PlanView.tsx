import { Button, Loader } from "@mantine/core";
import { useCallback, useState } from "react";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { Launch } from "./Launch";
import { useStationName } from "./names";
import { NO_TERMS, useOrder, usePlan } from "./order";
import { isPicked, pick, type PlanLine, selectText } from "./plan";
import { PlanTable } from "./PlanTable";
import classes from "./Restore.module.css";
import { Told } from "./Told";

const CONFIRM_MIN = 5;

/** The plan as a table, what it means for the blade beside it, and below that what begins it. */
export function PlanView() {
  const t = useTexts();
  const [, update] = usePageSearch();
  const [terms, setTerms] = useState(NO_TERMS);
  const [confirmMin, setConfirmMin] = useState(CONFIRM_MIN);
  const order = useOrder(terms);
  const planned = usePlan(order);
  const { plan, lines } = planned;
  const station = useStationName()(order?.station ?? "");
  const onPick = useCallback(
    (changed: readonly PlanLine[], on: boolean) => {
      const picked = new Set(lines.filter(isPicked).map((line) => line.id));
      update({ select: selectText(pick(lines, picked, changed, on)) });
    },
    [lines, update],
  );
  if (!order) return null;
  if (!plan)
    return planned.error === null ? (
      <p className={classes.note} role="status">
        <Loader size="sm" mr="sm" aria-hidden />
        {t("page.restoring.reading", { station })}
      </p>
    ) : (
      <div className={classes.note}>
        <ProblemAlert error={planned.error} title={t("page.restoring.no_plan")} />
        <Button mt="sm" variant="default" onClick={planned.readAgain}>
          {t("page.restoring.read_again")}
        </Button>
      </div>
    );
  return (
    <div className={classes.body} aria-busy={planned.outdated} data-testid="restore-plan">
      <PlanTable lines={lines} onPick={onPick} reading={planned.reading} onReadAgain={planned.readAgain} />
      <aside className={classes.aside}>
        <Told plan={plan} station={station} confirmMin={confirmMin} terms={terms} onTerms={setTerms} />
        <Launch
          planned={planned}
          order={order}
          station={station}
          terms={terms}
          onTerms={setTerms}
          confirmMin={confirmMin}
          onConfirmMin={setConfirmMin}
        />
      </aside>
    </div>
  );
}
