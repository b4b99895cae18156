import { Button } from "@mantine/core";
import {
  IconAlertOctagon,
  IconAlertTriangle,
  IconChevronLeft,
  IconChevronRight,
  IconInfoCircle,
} from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { keyEvents, type TripDoc, type TripStep, tripsQuery } from "../../../api/replay";
import { FrameLink } from "../../../frame/FrameLink";
import { useCursor, useStore } from "../../../live/live";
import { useLooking } from "../../../replay/looking";
import { useReplay } from "../../../replay/opening";
import { type Translate, useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { useDeviceName } from "../../../ui/devices";
import { timeOfDay } from "../../../ui/format";
import { figure } from "../../../model/values";
import classes from "./FirstOut.module.css";

const LOOKS = {
  info: { Icon: IconInfoCircle, tone: "dim" },
  warning: { Icon: IconAlertTriangle, tone: "tone-warning" },
  error: { Icon: IconAlertOctagon, tone: "tone-error" },
};

/** Why it tripped: what came first, what led from there to the trip, what followed. */
export function FirstOut({ replay }: { replay: string }) {
  const t = useTexts();
  const trips = useQuery(tripsQuery(replay));
  return (
    <>
      <KeyEventButtons replay={replay} />
      <div className={classes.scroll}>
        {trips.isError && <ProblemAlert error={trips.error} title={t("desk.trips_failed")} />}
        {trips.isPending && <p className={classes.empty}>{t("page.loading")}</p>}
        {trips.data?.trips.length === 0 && (
          <p className={classes.empty}>{trips.data.already?.[t.language] ?? t("desk.no_trip_long")}</p>
        )}
        {trips.data?.trips.map((trip) => (
          <Trip key={trip.number} trip={trip} count={trips.data.trips.length} />
        ))}
      </div>
    </>
  );
}

function Trip({ trip, count }: { trip: TripDoc; count: number }) {
  const t = useTexts();
  const transport = useReplay()?.transport;
  const first = trip.steps[trip.first];
  return (
    <section
      aria-label={t("desk.trip", { number: trip.number + 1, count })}
      data-testid={`trip-${trip.number}`}
    >
      <div className={classes.head}>
        <div className={classes.when}>
          {t("desk.trip_at", { number: trip.number + 1, count, time: timeOfDay(trip.t0_ns / 1e6) })}
        </div>
        <h2 data-testid="headline">{trip.headline[t.language]}</h2>
        {trip.already && (
          <p className={classes.when} data-testid="already">
            {trip.already[t.language]}
          </p>
        )}
        <div className={classes.jumps}>
          <Button variant="default" size="compact-sm" h={34} onClick={() => transport?.seek(trip.t0_ns)}>
            {t("desk.go_t0")}
          </Button>
          <Button
            variant="default"
            size="compact-sm"
            h={34}
            disabled={first === undefined}
            onClick={() => first && transport?.seek(first.t_ns)}
          >
            {t("desk.go_first")}
          </Button>
        </div>
      </div>
      <ol className={classes.steps}>
        {trip.steps.map((step, at) => (
          <Step key={at} step={step} language={t.language} />
        ))}
      </ol>
    </section>
  );
}

function Step({ step, language }: { step: TripStep; language: "en" | "de" }) {
  const t = useTexts();
  const looking = useLooking();
  const transport = useReplay()?.transport;
  const nameOf = useDeviceName();
  const { Icon, tone } = LOOKS[step.severity];
  const devices = [...new Set(step.at.map((one) => one.device))].flatMap((one) => one ?? []);
  const title = [devices.map(nameOf).join(", "), step.because_words?.[language]].filter(Boolean).join("\n");
  return (
    <li
      className={classes.step}
      data-role={step.role}
      title={title}
      onPointerEnter={() => looking.setHover(step.t_ns)}
      onPointerLeave={() => looking.setHover(null)}
    >
      <button type="button" onClick={() => transport?.seek(step.t_ns)} data-testid="trip-step">
        <span className={classes.dt}>{afterFirst(step.dt_ms, t)}</span>
        <Icon size={15} className={tone} aria-label={t(`page.severity.${step.severity}`)} />
        <span className={classes.says}>{step.says[language]}</span>
        <span className={classes.role}>{t(`analysis.role.${step.role}`)}</span>
      </button>
      <FrameLink tNs={step.t_ns} />
    </li>
  );
}

/** `−412 ms`, `+26.4 s` from what came first. */
function afterFirst(dtMs: number, t: Translate): string {
  const sign = dtMs < 0 ? "−" : dtMs > 0 ? "+" : "";
  const size = Math.abs(dtMs);
  if (size === 0) return "0";
  return size < 10_000
    ? `${sign}${figure(size, 0, t.language)} ms`
    : `${sign}${figure(size / 1000, 1, t.language)} s`;
}

/** To the trip, error or warning before the cursor, and to the next. */
function KeyEventButtons({ replay }: { replay: string }) {
  const t = useTexts();
  const store = useStore();
  const transport = useReplay()?.transport;
  const cursor = useCursor();
  const going = useMutation({
    mutationFn: async (forward: boolean) => {
      const tNs = store.cursor?.t_ns ?? 0;
      return (await keyEvents(replay, forward ? { after: tNs } : { before: tNs }))[0] ?? null;
    },
    onSuccess: (found) => {
      if (found) transport?.seek(found.t_ns);
    },
  });
  return (
    <div className={classes.keys}>
      <Button
        variant="default"
        leftSection={<IconChevronLeft size={16} aria-hidden />}
        disabled={cursor === null}
        onClick={() => going.mutate(false)}
        data-testid="key-before"
      >
        {t("desk.key_before")}
      </Button>
      <Button
        variant="default"
        rightSection={<IconChevronRight size={16} aria-hidden />}
        disabled={cursor === null}
        onClick={() => going.mutate(true)}
        data-testid="key-after"
      >
        {t("desk.key_after")}
      </Button>
      <span className={classes.found} role="status">
        {going.isError
          ? t("desk.trips_failed")
          : going.isSuccess
            ? (going.data?.says[t.language] ?? t("desk.no_key_event"))
            : t("desk.key_what")}
      </span>
    </div>
  );
}
