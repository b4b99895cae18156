import { useQuery } from "@tanstack/react-query";
import { useTurbineQuery } from "../../api/queries";
import { useShown } from "../../live/live";
import { Unconnected } from "../../frame/Unconnected";
import { Attention } from "./Attention";
import { BladeCard } from "./BladeCard";
import { SinceLastVisit } from "./SinceLastVisit";
import classes from "./Overview.module.css";

/** Three blades at one look, and above them what needs a look. */
export function OverviewPage() {
  const query = useQuery(useTurbineQuery());
  const { recorded } = useShown();
  const turbine = query.data;
  const blades = (turbine?.stations ?? []).filter((station) => station.blade !== null);
  return (
    <div className={classes.page}>
      <div className={classes.news}>
        <Attention />
        {!recorded && <SinceLastVisit />}
      </div>
      <div className={classes.cards}>
        {blades.map((station) => (
          <BladeCard key={station.slug} station={station} />
        ))}
      </div>
      {query.isSuccess && !turbine && <Unconnected />}
    </div>
  );
}
