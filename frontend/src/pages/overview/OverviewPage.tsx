import { useQuery } from "@tanstack/react-query";
import { turbineQuery } from "../../api/queries";
import { Unconnected } from "../../frame/Unconnected";
import { Attention } from "./Attention";
import { BladeCard } from "./BladeCard";
import { SinceLastVisit } from "./SinceLastVisit";
import classes from "./Overview.module.css";

/** Three blades at one look, and above them what needs a look. */
export function OverviewPage() {
  const query = useQuery(turbineQuery);
  const turbine = query.data;
  const blades = (turbine?.stations ?? []).filter((station) => station.blade !== null);
  return (
    <div className={classes.page}>
      <div className={classes.news}>
        <Attention />
        <SinceLastVisit />
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
