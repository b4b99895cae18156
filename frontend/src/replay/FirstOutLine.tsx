import { useQuery } from "@tanstack/react-query";
import { IconFlag } from "@tabler/icons-react";
import { type TripDoc, tripsQuery } from "../api/replay";
import { useCursor } from "../live/live";
import { useReplay } from "./opening";
import { useTexts } from "../texts/texts";
import classes from "./FirstOutLine.module.css";

/** The trip that the cursor is in or before: the one whose words matter here. */
export function tripAt(trips: readonly TripDoc[], tNs: number): TripDoc | undefined {
  return trips.find((trip) => (trip.ended_ns ?? Infinity) >= tNs) ?? trips.at(-1);
}

/** What came first at the trip, in words; pressed, the cursor goes there. Nothing where the recording shows no trip. */
export function FirstOutLine({ replay }: { replay: string }) {
  const t = useTexts();
  const cursor = useCursor();
  const transport = useReplay()?.transport;
  const found = useQuery(tripsQuery(replay)).data;
  if (found === undefined) return null;
  const trip = tripAt(found.trips, cursor?.t_ns ?? 0);
  if (trip === undefined)
    return <span className={classes.none}>{found.already?.[t.language] ?? t("desk.no_trip")}</span>;
  const text = trip.headline[t.language];
  return (
    <button
      type="button"
      className={classes.line}
      title={`${text} · ${t("desk.go_to_trip")}`}
      onClick={() => transport?.seek(trip.t0_ns)}
      data-testid="first-out-line"
    >
      <IconFlag size={15} aria-hidden />
      <span>{text}</span>
    </button>
  );
}
