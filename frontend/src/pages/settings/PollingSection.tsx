import { Button, Loader, NumberInput } from "@mantine/core";
import { IconDeviceFloppy } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { queryClient } from "../../api/queries";
import { type Polling, pollingQuery, settings } from "../../api/settings";
import { NeedsRole } from "../../frame/NeedsRole";
import { figure } from "../../model/values";
import { useTexts } from "../../texts/texts";
import { notify } from "../../ui/notices";
import { ProblemAlert } from "../../ui/ProblemAlert";
import { changeOf, type Field, LIMITS, loadOf, outOfRange, perSecond, RATES } from "./pollDraft";
import { PollTable } from "./PollTable";
import classes from "./Settings.module.css";

export function PollingSection() {
  const t = useTexts();
  const polling = useQuery(pollingQuery);
  if (polling.isError)
    return <ProblemAlert error={polling.error} title={t("page.settings.polling.failed")} />;
  if (!polling.data) return <Loader aria-label={t("page.loading")} />;
  return <PollEditor key={JSON.stringify(changeOf(polling.data))} before={polling.data} />;
}

function PollEditor({ before }: { before: Polling }) {
  const t = useTexts();
  const [draft, setDraft] = useState(before);
  const saving = useMutation({
    mutationFn: () => settings.changePolling(changeOf(draft)),
    onSuccess: (after) => {
      queryClient.setQueryData(pollingQuery.queryKey, after);
      notify({ tone: "ok", title: t("page.settings.polling.saved"), lines: [] });
    },
  });
  const touched = JSON.stringify(changeOf(draft)) !== JSON.stringify(changeOf(before));
  const wrong = outOfRange(draft);
  return (
    <>
      <Numbers draft={draft} wrong={wrong} onChange={setDraft} />
      <Loads draft={draft} />
      {draft.devices.map((device, at) => (
        <PollTable
          key={device.description_id}
          device={device}
          onChange={(changed) => setDraft({ ...draft, devices: draft.devices.with(at, changed) })}
        />
      ))}
      {saving.error !== null && (
        <ProblemAlert error={saving.error} title={t("page.settings.polling.not_saved")} />
      )}
      <div className={classes.foot}>
        <NeedsRole role="technician" device>
          {(locked) => (
            <Button
              leftSection={<IconDeviceFloppy size={18} aria-hidden />}
              disabled={locked || !touched || wrong.length > 0}
              loading={saving.isPending}
              onClick={() => saving.mutate()}
              data-testid="save-polling"
            >
              {t("page.settings.save")}
            </Button>
          )}
        </NeedsRole>
        <Button variant="default" disabled={!touched} onClick={() => setDraft(before)}>
          {t("page.settings.discard")}
        </Button>
        <span className="dim">{t("page.settings.polling.at_once")}</span>
      </div>
    </>
  );
}

interface NumbersProps {
  draft: Polling;
  wrong: readonly Field[];
  onChange: (draft: Polling) => void;
}

/** Numbers as people say them: ms and per cent. */
const SHOWN: Record<Field, { factor: number; unit: string }> = {
  period_s: { factor: 1000, unit: "ms" },
  slow_every: { factor: 1, unit: "" },
  rare_every: { factor: 1, unit: "" },
  load_cap: { factor: 100, unit: "%" },
};

function Numbers({ draft, wrong, onChange }: NumbersProps) {
  const t = useTexts();
  return (
    <div className={`${classes.card} ${classes.row}`} style={{ alignItems: "flex-start" }}>
      {(Object.keys(LIMITS) as Field[]).map((field) => {
        const { factor, unit } = SHOWN[field];
        const [least, most] = LIMITS[field];
        const limits = { least: least * factor, most: most * factor, unit };
        return (
          <NumberInput
            key={field}
            w={196}
            label={t(`page.settings.polling.${field}`)}
            description={describe(field)}
            inputWrapperOrder={["label", "input", "description", "error"]}
            value={Number((draft[field] * factor).toFixed(3))}
            suffix={unit === "" ? "" : ` ${unit}`}
            hideControls
            error={wrong.includes(field) ? t("page.settings.flaw.range", limits) : undefined}
            styles={{ input: { minHeight: 40 } }}
            onChange={(number) =>
              onChange({ ...draft, [field]: typeof number === "number" ? number / factor : NaN })
            }
            data-testid={`polling-${field}`}
          />
        );
      })}
    </div>
  );

  function describe(field: Field): string {
    if (field === "load_cap") return t("page.settings.polling.load_cap_note");
    const rate = field === "period_s" ? "fast" : field === "slow_every" ? "slow" : "rare";
    const times = perSecond(draft, rate);
    const number = times >= 1 ? figure(times, 0, t.language) : figure(1 / times, 1, t.language);
    return t(times >= 1 ? "page.settings.polling.per_second" : "page.settings.polling.each", { number });
  }
}

/** How much of each bus polling would take. */
function Loads({ draft }: { draft: Polling }) {
  const t = useTexts();
  return (
    <div className={classes.card}>
      <h2>{t("page.settings.polling.load")}</h2>
      {draft.buses.map((bus) => {
        const load = loadOf(draft, bus);
        const shown = load !== null && Number.isFinite(load) ? `${figure(load * 100, 1, t.language)} %` : "–";
        const over = load !== null && load > draft.load_cap;
        return (
          <div
            key={`${bus.turbine} ${bus.bus}`}
            style={{ marginBottom: 8 }}
            data-testid={`load-${bus.turbine}`}
          >
            <div className={classes.row} style={{ marginBottom: 4 }}>
              <span>
                {bus.turbine} · {bus.bus}
                {bus.bitrate > 0 && ` · ${String(bus.bitrate / 1000)} kbit/s`}
              </span>
              <span className={classes.spacer} />
              <strong className={over ? "tone-error" : ""}>{shown}</strong>
            </div>
            {load === null ? (
              <p className={classes.places}>{t("page.settings.modbus.no_load")}</p>
            ) : (
              <div className={classes.bar} data-over={over} aria-hidden>
                <span style={{ width: `${Math.min(100, load * 100)}%` }} />
                <i style={{ left: `${draft.load_cap * 100}%` }} />
              </div>
            )}
            {over && <div className="tone-error">{t("page.settings.polling.over")}</div>}
          </div>
        );
      })}
      <p className={classes.places}>
        {t("page.settings.polling.load_note", { rates: RATES.length, cap: Math.round(draft.load_cap * 100) })}
      </p>
    </div>
  );
}
