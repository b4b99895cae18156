import { useQuery } from "@tanstack/react-query";
import { turbineQuery } from "../../../api/queries";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { History } from "./History";
import { setsIn, useStation } from "./order";
import { PlanView } from "./PlanView";
import classes from "./Restore.module.css";
import { RestoreRun } from "./RestoreRun";
import { Setup } from "./Setup";

/** Sets put back into a station: chosen, planned, looked at, run, confirmed, proven; and all that were. */
export function RestoreTab() {
  const t = useTexts();
  const [search] = usePageSearch();
  const station = useStation();
  const connected = useQuery(turbineQuery).data !== undefined;
  if (search.restore !== undefined) return <RestoreRun key={search.restore} id={search.restore} />;
  // What an expert answers for at one station he does not answer for at another.
  const chosen = station !== undefined && setsIn(search.sets).length > 0;
  return (
    <div className={classes.room}>
      {connected ? <Setup /> : <p className={classes.note}>{t("page.restoring.connect_first")}</p>}
      {connected && chosen ? <PlanView key={station.slug} /> : <History />}
    </div>
  );
}
