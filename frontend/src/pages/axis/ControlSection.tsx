import { Button, Checkbox } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { type Interlock, interlocksQuery } from "../../api/motion";
import { NeedsRole } from "../../frame/NeedsRole";
import { useServerNow } from "../../live/live";
import { Control, type Looked, useControl, useLeaseActions } from "../../motion/lease";
import motion from "../../motion/Motion.module.css";
import { useTexts } from "../../texts/texts";
import { ProblemAlert } from "../../ui/ProblemAlert";

const SECOND_MS = 1000;

/** Who may move the axes: take it, ask for it, hand it over; and what a person has to look at. */
export function ControlSection({ device }: { device: string }) {
  const t = useTexts();
  const { state } = useControl();
  const actions = useLeaseActions();
  const error = Object.values(actions).find((action) => action.error !== null)?.error;
  return (
    <section aria-label={t("page.motion.control")}>
      <h3>{t("page.motion.control")}</h3>
      {state === Control.Own ? <Own actions={actions} device={device} /> : <NotOwn actions={actions} />}
      {error != null && <ProblemAlert error={error} title={t("page.motion.control_failed")} />}
    </section>
  );
}

type Actions = ReturnType<typeof useLeaseActions>;

function NotOwn({ actions }: { actions: Actions }) {
  const t = useTexts();
  const { motion: line, state, asking, refused } = useControl();
  const person = line?.holder?.person ?? "";
  const free = state === Control.Free;
  return (
    <>
      <p>{free ? t("page.motion.free") : t("page.motion.held_by", { person })}</p>
      {refused && <p className="tone-warning">{t("page.motion.refused", { person })}</p>}
      <div className={motion.row}>
        <NeedsRole role="technician" device>
          {(locked) =>
            asking ? (
              <Button variant="default" onClick={() => actions.withdraw.mutate()} data-testid="withdraw">
                {t("page.motion.withdraw")}
              </Button>
            ) : (
              <Button
                disabled={locked}
                loading={actions.take.isPending || actions.ask.isPending}
                onClick={() => (free ? actions.take : actions.ask).mutate()}
                data-testid="take-control"
              >
                {t(free ? "page.motion.take" : "page.motion.ask")}
              </Button>
            )
          }
        </NeedsRole>
      </div>
    </>
  );
}

function Own({ actions, device }: { actions: Actions; device: string }) {
  const t = useTexts();
  const { motion: line } = useControl();
  const { data } = useQuery(interlocksQuery(device));
  // Shown at once; nobody else can confirm while this page has control, and with another lease this begins anew.
  const [mine, setMine] = useState<Looked | null>(null);
  if (!line) return null;
  const looked = mine ?? {
    rotorLocked: line.rotor_locked,
    peopleOut: line.people_out,
    externalStops: line.external_stops,
  };
  const asks = (name: string) => data?.some((one) => one.name === name) ?? false;
  const stop = stopOf(data);
  const confirm = (one: Looked) => {
    setMine(one);
    actions.confirm.mutate(one, { onError: () => setMine(null) });
  };
  return (
    <>
      <Asked actions={actions} />
      {/* What is to be confirmed is what holds this axis back. */}
      {asks("rotor_locked") && (
        <Checkbox
          checked={looked.rotorLocked}
          onChange={(event) => confirm({ ...looked, rotorLocked: event.currentTarget.checked })}
          label={t("page.motion.rotor_locked")}
          data-testid="rotor-locked"
          my={6}
        />
      )}
      {(asks("people_out") || asks("zone_clear")) && (
        <Checkbox
          checked={looked.peopleOut}
          onChange={(event) => confirm({ ...looked, peopleOut: event.currentTarget.checked })}
          label={t(asks("zone_clear") ? "page.motion.zone_clear" : "page.motion.people_out")}
          data-testid="people-out"
          my={6}
        />
      )}
      {stop !== null && (
        <NeedsRole role="expert" device>
          {(locked) => (
            <Checkbox
              checked={looked.externalStops.includes(device)}
              disabled={locked}
              onChange={(event) => {
                const others = looked.externalStops.filter((one) => one !== device);
                confirm({
                  ...looked,
                  externalStops: event.currentTarget.checked ? [...others, device] : others,
                });
              }}
              label={t("page.motion.external_stop", { stop })}
              description={locked ? t("page.motion.external_stop_role") : undefined}
              data-testid="external-stop"
              my={6}
            />
          )}
        </NeedsRole>
      )}
      <div className={motion.row}>
        <Button variant="default" onClick={() => actions.giveBack.mutate()} data-testid="give-back">
          {t("page.motion.give_back")}
        </Button>
      </div>
    </>
  );
}

const ANSWERED_FOR = ["interlock.external_stop.confirmed", "interlock.external_stop.not_confirmed"];

/** The stop by hand that the site file names for the drive; null where none has to be answered for. */
function stopOf(interlocks: readonly Interlock[] | undefined): string | null {
  const details = interlocks?.find((one) => one.name === "self_stop")?.details;
  return details && ANSWERED_FOR.includes(String(details.state_key)) ? String(details.stop) : null;
}

/** Somebody else wants it: without an answer it is theirs after a while. */
function Asked({ actions }: { actions: Actions }) {
  const t = useTexts();
  const { asked } = useControl();
  const nowMs = useServerNow(SECOND_MS);
  if (asked === null) return null;
  const left = Math.max(0, Math.round((asked.until_ns / 1e6 - nowMs) / SECOND_MS));
  return (
    <div role="alert" data-testid="asked">
      <p className="tone-warning">{t("page.motion.asked", { person: asked.person, seconds: left })}</p>
      <div className={motion.row}>
        <Button onClick={() => actions.answer.mutate(true)}>{t("page.motion.hand_over")}</Button>
        <Button variant="default" onClick={() => actions.answer.mutate(false)}>
          {t("page.motion.keep")}
        </Button>
      </div>
    </div>
  );
}
