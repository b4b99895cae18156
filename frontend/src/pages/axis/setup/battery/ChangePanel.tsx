import { Button, TextInput } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import {
  battery,
  batteryHistoryQuery,
  batteryQuery,
  type ChangeRecord,
  type Figures,
  type Noted,
} from "../../../../api/battery";
import { NeedsRole } from "../../../../frame/NeedsRole";
import { useTexts } from "../../../../texts/texts";
import { HoldButton } from "../../../../ui/HoldButton";
import { ProblemAlert } from "../../../../ui/ProblemAlert";
import { dateAndTime } from "../../../../ui/format";
import axis from "../../Axis.module.css";
import classes from "./Battery.module.css";

const AT_THE_MACHINE = ["lock", "off", "voltage", "swap", "check", "on"] as const;
const MOST_LETTERS = 200;

/** The change of a battery, step by step; it goes on where it was left, after a reload and on another day. */
export function ChangePanel({ slug }: { slug: string }) {
  const t = useTexts();
  const { data } = useQuery(batteryQuery(slug));
  const changes = useQuery(batteryHistoryQuery(slug)).data?.changes ?? [];
  const noted = data?.noted ?? null;
  return (
    <section
      className={`${axis.panel} ${axis.wide}`}
      aria-label={t("page.setup.battery.change")}
      data-testid="battery-change"
    >
      <h2>{t("page.setup.battery.change")}</h2>
      <p>{t("page.setup.battery.change_why")}</p>
      <ol className={classes.steps}>
        <li {...(noted === null ? { "aria-current": "step" as const } : {})}>
          <strong>{t("page.setup.battery.change_note")}</strong>
          {noted === null ? <NoteOld slug={slug} /> : <Old noted={noted} />}
        </li>
        <li>
          <strong>{t("page.setup.battery.change_machine")}</strong>
          <ul>
            {AT_THE_MACHINE.map((one) => (
              <li key={one}>{t(`page.setup.battery.machine.${one}`)}</li>
            ))}
          </ul>
        </li>
        <li {...(noted === null ? {} : { "aria-current": "step" as const })}>
          <strong>{t("page.setup.battery.change_reset")}</strong>
          <Reset slug={slug} disabled={noted === null} />
        </li>
      </ol>
      {changes.length > 0 && <Changes changes={changes} />}
    </section>
  );
}

function useRenew(slug: string) {
  const client = useQueryClient();
  return async () => {
    await client.invalidateQueries({ queryKey: batteryQuery(slug).queryKey });
    await client.invalidateQueries({ queryKey: batteryHistoryQuery(slug).queryKey });
  };
}

function NoteOld({ slug }: { slug: string }) {
  const t = useTexts();
  const renew = useRenew(slug);
  const [serials, setSerials] = useState("");
  const note = useMutation({ mutationFn: () => battery.note(slug, serials), onSettled: renew });
  return (
    <>
      <p>{t("page.setup.battery.note_explain")}</p>
      <div className={classes.row}>
        <TextInput
          label={t("page.setup.battery.old_serials")}
          value={serials}
          maxLength={MOST_LETTERS}
          onChange={(event) => setSerials(event.currentTarget.value)}
          w={320}
          data-testid="old-serials"
        />
        <NeedsRole role="technician" device>
          {(locked) => (
            <Button
              disabled={locked || serials.trim() === ""}
              loading={note.isPending}
              onClick={() => note.mutate()}
              data-testid="note-old"
            >
              {t("page.setup.battery.note_old")}
            </Button>
          )}
        </NeedsRole>
      </div>
      {note.error !== null && <ProblemAlert error={note.error} title={t("page.setup.battery.note_failed")} />}
    </>
  );
}

function Old({ noted }: { noted: Noted }) {
  const t = useTexts();
  const renew = useRenew(noted.device);
  const giveUp = useMutation({ mutationFn: () => battery.giveUp(noted.device), onSettled: renew });
  return (
    <div data-testid="noted">
      <p>
        {t("page.setup.battery.noted", {
          when: dateAndTime(noted.t_ns / 1e6),
          person: noted.person,
          serials: noted.serials,
        })}
      </p>
      <p>{figuresText(noted.figures, t)}</p>
      <Button
        variant="subtle"
        px="xs"
        loading={giveUp.isPending}
        onClick={() => giveUp.mutate()}
        data-testid="give-up-change"
      >
        {t("page.setup.battery.give_up")}
      </Button>
      {giveUp.error !== null && (
        <ProblemAlert error={giveUp.error} title={t("page.setup.battery.give_up_failed")} />
      )}
    </div>
  );
}

function figuresText(figures: Figures, t: ReturnType<typeof useTexts>): string {
  return t("page.setup.battery.figures", {
    charged: figures.charged_mah ?? "–",
    health: figures.health_percent ?? "–",
    charge: figures.charge_percent ?? "–",
    volts: figures.off_load_v ?? "–",
    ohm: figures.resistance_mohm ?? "–",
  });
}

function Reset({ slug, disabled }: { slug: string; disabled: boolean }) {
  const t = useTexts();
  const renew = useRenew(slug);
  const [serials, setSerials] = useState("");
  const [remark, setRemark] = useState("");
  const done = useMutation({
    mutationFn: () => battery.done(slug, serials, remark),
    onSuccess: () => {
      setSerials("");
      setRemark("");
    },
    onSettled: renew,
  });
  return (
    <>
      <p>{t("page.setup.battery.reset_explain")}</p>
      <div className={classes.row}>
        <TextInput
          label={t("page.setup.battery.new_serials")}
          value={serials}
          maxLength={MOST_LETTERS}
          disabled={disabled}
          onChange={(event) => setSerials(event.currentTarget.value)}
          w={320}
          data-testid="new-serials"
        />
        <TextInput
          label={t("page.setup.battery.remark")}
          value={remark}
          maxLength={500}
          disabled={disabled}
          onChange={(event) => setRemark(event.currentTarget.value)}
          w={260}
          data-testid="change-remark"
        />
        <NeedsRole role="technician" device>
          {(locked) => (
            <HoldButton
              tone="danger"
              hint={t("page.setup.battery.hold")}
              disabled={locked || disabled || serials.trim() === "" || done.isPending}
              onHeld={() => done.mutate()}
              testId="change-done"
            >
              {t("page.setup.battery.reset")}
            </HoldButton>
          )}
        </NeedsRole>
      </div>
      {done.data !== undefined && (
        <p className="tone-ok" role="status" data-testid="changed">
          ✓ {t("page.setup.battery.changed", { counter: done.data.counter_mah })}
        </p>
      )}
      {done.error !== null && (
        <ProblemAlert error={done.error} title={t("page.setup.battery.reset_failed")} />
      )}
    </>
  );
}

function Changes({ changes }: { changes: readonly ChangeRecord[] }) {
  const t = useTexts();
  return (
    <div className={classes.scroll} tabIndex={0} role="region" aria-label={t("page.setup.battery.changes")}>
      <table className={axis.history} data-testid="earlier-changes">
        <caption className="visually-hidden">{t("page.setup.battery.changes")}</caption>
        <thead>
          <tr>
            {["when", "old", "new", "counter", "health", "remark", "who"].map((name) => (
              <th key={name} scope="col">
                {t(`page.setup.battery.column.${name}`)}
              </th>
            ))}
          </tr>
        </thead>
        <tbody>
          {changes.map((one) => (
            <tr key={one.id}>
              <td>{dateAndTime(one.t_ns / 1e6)}</td>
              <td>{one.old.serials}</td>
              <td>{one.serials}</td>
              <td>{one.old.figures.charged_mah === null ? "–" : `${one.old.figures.charged_mah} mAh`}</td>
              <td>{one.old.figures.health_percent === null ? "–" : `${one.old.figures.health_percent} %`}</td>
              <td>{one.remark === "" ? "–" : one.remark}</td>
              <td>{one.person}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}
