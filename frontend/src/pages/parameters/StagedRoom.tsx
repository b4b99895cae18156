import { useQuery } from "@tanstack/react-query";
import { type ReactNode, useEffect, useMemo } from "react";
import { useTurbineQuery } from "../../api/queries";
import { usePageSearch } from "../../frame/search";
import { useShown } from "../../live/live";
import { placesOf } from "../../ui/devices";
import { PendingBar } from "./PendingBar";
import classes from "./Parameters.module.css";
import { ReplayLock } from "./ReplayLock";
import { ReviewDialog } from "./ReviewDialog";
import { RuleButton, RuleOverview } from "./RuleOverview";
import { JudgedContext, useJudged } from "./rules";
import { staged } from "./staging";
import { useFinishWriting } from "./writing";

/**
 * A room that stages changes of the connected turbine: they are kept and judged together wherever they were made, and
 * reviewed, written and followed right there. Once on the page.
 */
export function StagedRoom({ children }: { children: ReactNode }) {
  const [search, update] = usePageSearch();
  const turbine = useQuery(useTurbineQuery()).data;
  const places = useMemo(() => placesOf(turbine), [turbine]);
  const { recorded } = useShown();
  const slug = recorded ? undefined : turbine?.slug;
  useEffect(() => {
    if (slug !== undefined) staged.open(slug);
  }, [slug]);
  useFinishWriting();
  const judged = useJudged(slug !== undefined);
  return (
    <JudgedContext value={judged}>
      {children}
      {search.review === "open" && slug !== undefined && (
        <ReviewDialog places={places} onClose={() => update({ review: undefined })} />
      )}
      {search.findings === "open" && slug !== undefined && (
        <RuleOverview places={places} onClose={() => update({ findings: undefined })} />
      )}
    </JudgedContext>
  );
}

/** What is pending, the way to its review and what the rules say of it; of a recording, why nothing can be changed. */
export function StagedBar() {
  const { recorded } = useShown();
  if (recorded) return <ReplayLock />;
  return (
    <div className={classes.stagedBar}>
      <PendingBar />
      <RuleButton />
    </div>
  );
}
