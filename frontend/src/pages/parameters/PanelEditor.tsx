import { Alert, Button, Checkbox, Group, Stack } from "@mantine/core";
import { IconArrowRight, IconLock, IconPencilPlus } from "@tabler/icons-react";
import { useState } from "react";
import type { EntryDoc, Raw } from "../../api/types";
import { useCell, useDeviceVersion } from "../../live/live";
import { usePageSearch } from "../../frame/search";
import { planOf } from "../../model/findings";
import type { Lock } from "../../model/locks";
import { type DeviceContext, lineOf, shownOf } from "../../model/shown";
import type { Change } from "../../model/staged";
import { hexadecimal, isInteger } from "../../model/values";
import { rawOf } from "./cellValue";
import { useBenchOfTable, useDevice } from "./context";
import { type Draft, startText, useDraft } from "./draft";
import { FindingList } from "./FindingList";
import classes from "./Parameters.module.css";
import { Places } from "./Places";
import { RuleFindingList } from "./RuleFindingList";
import { useFindingsOf } from "./rules";
import { groundOf, plannedContext, stage, unstage, useChange, useStaged } from "./staging";
import { ValueEditor } from "./ValueEditor";

export function Locked({ entry, lock }: { entry: EntryDoc; lock: Lock }) {
  const { t } = useDevice();
  return (
    <>
      <Places entry={entry} onTake={null} />
      <Alert color="gray" icon={<IconLock aria-hidden />} p="sm" data-testid="locked">
        {t(`page.locked.${lock}`)}
      </Alert>
    </>
  );
}

/**
 * Editor, RAM and store told apart; what is typed becomes a pending change, and nothing is sent. What is said of it while
 * it is typed comes below the button, in a place of its own: the button never moves away from the pointer.
 */
export function PanelEditor({ entry }: { entry: EntryDoc }) {
  const device = useDevice();
  const { t, slug } = device;
  const { siblings } = useBenchOfTable();
  const cell = useCell(slug, entry.address);
  const change = useChange(slug, entry.address);
  const known = change?.raw ?? rawOf(cell);
  const [begun, setBegun] = useState(known !== null);
  const draft = useDraft(entry, device, startText(entry, known, device));
  // Starts from the value in RAM, as soon as that is known, and does not follow it after that.
  if (!begun && known !== null) {
    setBegun(true);
    if (draft.text === "") draft.setText(startText(entry, known, device));
  }
  const [all, setAll] = useState(false);
  const targets = all ? siblings : [device];
  const take = (raw: Raw) => draft.setText(startText(entry, raw, device));
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault();
        if (draft.raw !== null) stage(entry, draft.raw, targets);
      }}
    >
      <Stack gap="sm">
        <ValueEditor entry={entry} draft={draft} />
        <Preview entry={entry} from={rawOf(cell)} to={draft.raw} />
        {siblings.length > 1 && (
          <Checkbox
            label={t("page.stage.all", { count: siblings.length })}
            checked={all}
            onChange={(event) => setAll(event.currentTarget.checked)}
            data-testid="apply-all"
          />
        )}
        <Group gap="xs">
          <Button
            type="submit"
            disabled={draft.raw === null || isDone(draft.raw, entry, targets, change)}
            leftSection={<IconPencilPlus size={17} aria-hidden />}
            data-testid="stage"
          >
            {t(change ? "page.stage.replace" : "page.stage.button")}
          </Button>
          {change && (
            <Button variant="default" onClick={() => unstage(entry, [device])} data-testid="unstage">
              {t("page.stage.drop")}
            </Button>
          )}
        </Group>
        <div className={classes.said} data-testid="said">
          <Speaks entry={entry} draft={draft} />
          <RulesSay entry={entry} draft={draft} />
        </div>
        <Places entry={entry} onTake={take} />
      </Stack>
    </form>
  );
}

/** True where staging would change nothing: it is pending already, or RAM holds it. */
function isDone(
  raw: Raw,
  entry: EntryDoc,
  targets: readonly DeviceContext[],
  change: Change | undefined,
): boolean {
  if (targets.length > 1) return false;
  const [only] = targets;
  return change ? change.raw === raw && change.refused === null : only?.lookup(entry.address) === raw;
}

function Preview({ entry, from, to }: { entry: EntryDoc; from: Raw | null; to: Raw | null }) {
  const device = useDevice();
  if (to === null) return <div className={classes.preview} />;
  const hex = isInteger(entry) && typeof to === "number" ? hexadecimal(entry, to) : "";
  return (
    <div className={classes.preview} data-testid="preview">
      {from !== to && (
        <>
          <span className="dim">{from === null ? "–" : lineOf(shownOf(entry, from, device))}</span>
          <IconArrowRight size={16} aria-hidden />
        </>
      )}
      <b>{lineOf(shownOf(entry, to, plannedContext(device)))}</b>
      <span className="dim">
        {device.t("page.entry.raw_only", { raw: hex === "" ? to : `${to} · ${hex}` })}
      </span>
    </div>
  );
}

/** What the rules of the station say of the draft while it is typed, with all that is pending on all its devices. */
function RulesSay({ entry, draft }: { entry: EntryDoc; draft: Draft }) {
  const device = useDevice();
  const [, update] = usePageSearch();
  const findings = useFindingsOf(entry, device, draft.raw);
  return (
    <RuleFindingList
      findings={findings}
      here={{ device: device.slug, address: entry.address }}
      onJump={(slug, edit) => update({ device: slug, edit, q: undefined })}
    />
  );
}

/** What speaks against the draft while it is typed, with all else that is pending for the device. */
function Speaks({ entry, draft }: { entry: EntryDoc; draft: Draft }) {
  const device = useDevice();
  const { role } = useBenchOfTable();
  const { changes } = useStaged();
  useDeviceVersion(device.slug);
  const ram = device.lookup(entry.address);
  if (draft.raw === null || draft.raw === ram) return null;
  const others = [...changes.values()].filter(
    (one) => one.device === device.slug && one.address !== entry.address,
  );
  const own: Change = {
    device: device.slug,
    address: entry.address,
    raw: draft.raw,
    from: ram,
    atMs: 0,
    refused: null,
  };
  const row = planOf([...others, own], groundOf(device, role)).find((one) => one.change === own);
  return <FindingList findings={row?.findings ?? []} entry={entry} device={device} />;
}
