import { Badge, Button, Checkbox, Progress, Select, TextInput } from "@mantine/core";
import { IconArrowBarToDown, IconRadar2 } from "@tabler/icons-react";
import { useState } from "react";
import { type FoundDevice, settings, type Site, type SiteBus, type SiteTurbine } from "../../api/settings";
import { NeedsRole } from "../../frame/NeedsRole";
import { useTexts } from "../../texts/texts";
import { JobProblem } from "./JobProblem";
import { isProfibus } from "./profibusDraft";
import classes from "./Settings.module.css";
import { isKnown, takeOver, type TakenOver } from "./siteDraft";
import { type StartedJob, useSettingsJob } from "./useSettingsJob";

interface Props {
  bus: SiteBus;
  draft: SiteTurbine;
  descriptions: Site["descriptions"];
  onTaken: (draft: SiteTurbine) => void;
}

/** Asks every node of a bus what it is; what is found can be taken over into the turbine that is edited. */
export function ScanPanel({ bus, draft, descriptions, onTaken }: Props) {
  const t = useTexts();
  const work = useSettingsJob();
  const [consent, setConsent] = useState(false);
  const { job, running } = work;
  const needsConsent = job?.error?.code === "consent";
  return (
    <div className={classes.turbine} style={{ padding: "12px 0 4px" }} data-testid="scan-panel">
      <p className={classes.places}>
        {t(isProfibus(bus) ? "lines.site.scan_explain" : "page.settings.scan.explain")}
      </p>
      <div className={classes.row}>
        <NeedsRole role="technician" device>
          {(locked) => (
            <Button
              leftSection={<IconRadar2 size={18} aria-hidden />}
              disabled={locked || running || (needsConsent && !consent)}
              onClick={() => work.start(() => settings.scan(bus, consent))}
              data-testid="start-scan"
            >
              {t("page.settings.scan.start")}
            </Button>
          )}
        </NeedsRole>
        {running && (
          <Button variant="subtle" onClick={work.cancel}>
            {t("page.cancel")}
          </Button>
        )}
        {(needsConsent || consent) && (
          <Checkbox
            label={t("page.settings.scan.consent")}
            checked={consent}
            onChange={(event) => setConsent(event.currentTarget.checked)}
          />
        )}
      </div>
      {running && <ScanProgress work={work} />}
      <JobProblem work={work} title={t("page.settings.scan.failed")} />
      {job?.scan && (
        <Found
          key={job.id}
          found={job.scan.found}
          bus={bus.name}
          draft={draft}
          descriptions={descriptions}
          onTaken={onTaken}
        />
      )}
    </div>
  );
}

function ScanProgress({ work }: { work: StartedJob }) {
  const t = useTexts();
  const { done = 0, total = 0 } = work.job ?? {};
  return (
    <Progress
      animated
      value={total === 0 ? 100 : (100 * done) / total}
      aria-label={t("page.settings.scan.progress")}
    />
  );
}

interface FoundProps extends Omit<Props, "bus"> {
  found: FoundDevice[];
  bus: string;
}

interface Choice {
  take: boolean;
  station: string;
  device: string;
  description_id: string;
}

const choiceFor = (found: FoundDevice, known: boolean): Choice => ({
  take: !known && found.description_id !== null,
  station: found.station,
  device: found.device,
  description_id: found.description_id ?? "",
});

function Found({ found, bus, draft, descriptions, onTaken }: FoundProps) {
  const t = useTexts();
  const [choices, setChoices] = useState(
    () => new Map(found.map((one) => [one.node, choiceFor(one, isKnown(draft, bus, one.node))])),
  );
  if (found.length === 0) return <p role="status">{t("page.settings.scan.nobody")}</p>;
  const taken: TakenOver[] = found.flatMap((one) => {
    const choice = choices.get(one.node);
    if (!choice?.take || choice.description_id === "" || isKnown(draft, bus, one.node)) return [];
    return [
      { found: one, station: choice.station, device: choice.device, description_id: choice.description_id },
    ];
  });
  return (
    <>
      <div className={classes.tableBox}>
        <table className={classes.table} data-testid="found">
          <thead>
            <tr>
              {["take", "node", "is", "description", "place"].map((head) => (
                <th key={head}>{t(`page.settings.scan.head.${head}`)}</th>
              ))}
            </tr>
          </thead>
          <tbody>
            {found.map((one) => (
              <FoundRow
                key={one.node}
                found={one}
                known={isKnown(draft, bus, one.node)}
                choice={choices.get(one.node) ?? choiceFor(one, true)}
                descriptions={descriptions}
                onChoose={(choice) => setChoices(new Map(choices).set(one.node, choice))}
              />
            ))}
          </tbody>
        </table>
      </div>
      <div className={classes.row}>
        <Button
          leftSection={<IconArrowBarToDown size={18} aria-hidden />}
          disabled={taken.length === 0}
          onClick={() => onTaken(takeOver(draft, bus, taken))}
          data-testid="take-over"
        >
          {t("page.settings.scan.take", { count: taken.length })}
        </Button>
        <span className="dim">{t("page.settings.scan.take_note")}</span>
      </div>
    </>
  );
}

interface RowProps {
  found: FoundDevice;
  known: boolean;
  choice: Choice;
  descriptions: Site["descriptions"];
  onChoose: (choice: Choice) => void;
}

function FoundRow({ found, known, choice, descriptions, onChoose }: RowProps) {
  const t = useTexts();
  return (
    <tr data-testid={`found-${found.node}`}>
      <td>
        <Checkbox
          aria-label={t("page.settings.scan.take_one", { node: found.node })}
          checked={choice.take && !known}
          disabled={known || choice.description_id === ""}
          onChange={(event) => onChoose({ ...choice, take: event.currentTarget.checked })}
        />
      </td>
      <td>{found.node}</td>
      <td>
        {found.device_name ?? "–"}{" "}
        {found.twin && (
          <Badge color="blue.8" variant="filled" tt="none">
            {t("page.mode.simulated")}
          </Badge>
        )}
        <div className="dim" style={{ fontSize: 12.5 }}>
          {t("page.settings.scan.identity", {
            software: found.software,
            hardware: found.hardware,
            serial: found.serial === null ? null : String(found.serial),
          })}
        </div>
      </td>
      <td>
        <Select
          w={150}
          aria-label={t("page.settings.turbines.description")}
          data={descriptions.map((one) => ({ value: one.id, label: one.name }))}
          value={choice.description_id || null}
          placeholder={t("page.settings.scan.unrecognised")}
          disabled={known}
          allowDeselect={false}
          onChange={(id) => onChoose({ ...choice, description_id: id ?? "" })}
        />
      </td>
      <td>
        {known ? (
          <span className="dim">{t("page.settings.scan.known")}</span>
        ) : (
          <div className={classes.row} style={{ flexWrap: "nowrap", gap: 4 }}>
            <TextInput
              w={96}
              aria-label={t("page.settings.turbines.station")}
              value={choice.station}
              onChange={(event) => onChoose({ ...choice, station: event.currentTarget.value })}
            />
            /
            <TextInput
              w={86}
              aria-label={t("page.settings.turbines.device")}
              value={choice.device}
              onChange={(event) => onChoose({ ...choice, device: event.currentTarget.value })}
            />
          </div>
        )}
      </td>
    </tr>
  );
}
