import { useQuery } from "@tanstack/react-query";
import { useTurbineQuery } from "../../api/queries";
import { useShown } from "../../live/live";
import { Unconnected } from "../../frame/Unconnected";
import { Attention } from "./Attention";
import { BenchCard } from "./BenchCard";
import { BladeCard } from "./BladeCard";
import { SinceLastVisit } from "./SinceLastVisit";
import classes from "./Overview.module.css";

/** Three blades at one look, or what a bench has instead, and above them what needs a look. */
export function OverviewPage() {
  const query = useQuery(useTurbineQuery());
  const { recorded } = useShown();
  const turbine = query.data;
  const stations = turbine?.stations ?? [];
  return (
    <div className={classes.page}>
      <div className={classes.news}>
        <Attention />
        {!recorded && <SinceLastVisit />}
      </div>
      <div className={classes.cards}>
        {stations.map((station) =>
          station.blade === null ? (
            <BenchCard key={station.slug} station={station} />
          ) : (
            <BladeCard key={station.slug} station={station} />
          ),
        )}
      </div>
      {query.isSuccess && !turbine && <Unconnected />}
    </div>
  );
}
