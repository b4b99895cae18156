import { Checkbox, NumberInput, Select, Switch, TextInput } from "@mantine/core";
import { useState } from "react";
import type { Pdo, PdoFinding, PdoSetup } from "../../../api/pdo";
import { useTexts } from "../../../texts/texts";
import { typedNumber } from "../../../ui/typedNumber";
import {
  allowsRemote,
  canIdOf,
  hexId,
  isEnabled,
  parseCanId,
  withCanId,
  withEnabled,
  withRemote,
} from "./edits";
import { Findings } from "./Findings";
import { inhibitMs, typeText } from "./names";
import classes from "./Pdo.module.css";

interface Props {
  pdo: Pdo;
  setup: PdoSetup;
  findings: readonly PdoFinding[];
  locked: boolean;
  onChange: (setup: PdoSetup) => void;
}

const SUB_INHIBIT = 3;
const SUB_EVENT = 5;
const SUB_SYNC_START = 6;
const LAST_SYNC = 240;
const SYNC_NTH = 2;
const KINDS = { rpdo: [1, 254, 255], tpdo: [0, 1, SYNC_NTH, 252, 253, 254, 255] } as const;
const MAX_U16 = 65_535;

/** When a PDO goes, under which identifier, and whether at all. */
export function PdoFields({ pdo, setup, findings, locked, onChange }: Props) {
  const t = useTexts();
  const at = (part: PdoFinding["part"]) => (
    <Findings findings={findings.filter((one) => one.part === part)} />
  );
  return (
    <div className={classes.fields}>
      <Switch
        label={t("page.pdo.enabled")}
        checked={isEnabled(setup)}
        disabled={locked}
        onChange={(event) => onChange(withEnabled(setup, event.currentTarget.checked))}
        size="md"
        data-testid="pdo-enabled"
      />
      <CanId key={setup.cob_id} setup={setup} locked={locked} onChange={onChange} />
      {at("cob_id")}
      {pdo.direction === "tpdo" && (
        <Checkbox
          label={t("page.pdo.remote")}
          checked={allowsRemote(setup)}
          disabled={locked}
          onChange={(event) => onChange(withRemote(setup, event.currentTarget.checked))}
        />
      )}
      <Transmission pdo={pdo} setup={setup} locked={locked} onChange={onChange} />
      {at("type")}
      {pdo.subs.includes(SUB_INHIBIT) && (
        <NumberInput
          label={t("page.pdo.inhibit")}
          suffix=" ms"
          value={inhibitMs(setup)}
          min={0}
          max={MAX_U16 / 10}
          step={0.1}
          decimalScale={1}
          disabled={locked}
          onChange={(value) =>
            typedNumber(value, (ms) => onChange({ ...setup, inhibit_100us: Math.round(ms * 10) }))
          }
          data-testid="pdo-inhibit"
        />
      )}
      {at("inhibit")}
      {pdo.subs.includes(SUB_EVENT) && (
        <NumberInput
          label={t("page.pdo.event")}
          suffix=" ms"
          value={setup.event_ms}
          min={0}
          max={MAX_U16}
          allowDecimal={false}
          disabled={locked}
          onChange={(value) => typedNumber(value, (event_ms) => onChange({ ...setup, event_ms }))}
          data-testid="pdo-event"
        />
      )}
      {at("event")}
      {pdo.subs.includes(SUB_SYNC_START) && (
        <NumberInput
          label={t("page.pdo.sync_start")}
          value={setup.sync_start}
          min={0}
          max={LAST_SYNC}
          allowDecimal={false}
          disabled={locked}
          onChange={(value) => typedNumber(value, (sync_start) => onChange({ ...setup, sync_start }))}
        />
      )}
      {at("sync_start")}
    </div>
  );
}

/** A text that is an identifier counts at once; any other stays in the field and is marked. */
function CanId({ setup, locked, onChange }: Pick<Props, "setup" | "locked" | "onChange">) {
  const t = useTexts();
  const [text, setText] = useState<string | null>(null);
  const shown = text ?? hexId(canIdOf(setup));
  return (
    <TextInput
      label={t("page.pdo.cob_id")}
      value={shown}
      rightSection="h"
      maxLength={10}
      error={parseCanId(shown) === null}
      disabled={locked}
      onChange={(event) => setText(event.currentTarget.value)}
      onBlur={() => {
        const id = parseCanId(shown);
        if (id !== null && id !== canIdOf(setup)) onChange(withCanId(setup, id));
        setText(null);
      }}
      onKeyDown={(event) => {
        if (event.key === "Enter") event.currentTarget.blur();
      }}
      data-testid="pdo-cob-id"
    />
  );
}

function Transmission({ pdo, setup, locked, onChange }: Omit<Props, "findings">) {
  const t = useTexts();
  const type = setup.transmission_type;
  const nth = pdo.direction === "tpdo" && type >= SYNC_NTH && type <= LAST_SYNC;
  const own = nth ? SYNC_NTH : pdo.direction === "rpdo" && type <= LAST_SYNC ? 1 : type;
  const kinds: readonly number[] = KINDS[pdo.direction];
  const shown = kinds.includes(own) ? kinds : [...kinds, own];
  const label = (kind: number) =>
    kind === SYNC_NTH && pdo.direction === "tpdo"
      ? t("page.pdo.every_nth")
      : typeText(pdo.direction, kind === own ? type : kind, t);
  return (
    <>
      <Select
        label={t("page.pdo.transmission")}
        data={shown.map((kind) => ({ value: String(kind), label: label(kind) }))}
        value={String(own)}
        allowDeselect={false}
        disabled={locked}
        onChange={(value) => value !== null && onChange({ ...setup, transmission_type: Number(value) })}
        data-testid="pdo-type"
      />
      {nth && (
        <NumberInput
          label="n"
          value={type}
          min={SYNC_NTH}
          max={LAST_SYNC}
          allowDecimal={false}
          disabled={locked}
          onChange={(value) =>
            typedNumber(value, (n) => {
              if (n >= SYNC_NTH && n <= LAST_SYNC) onChange({ ...setup, transmission_type: n });
            })
          }
        />
      )}
    </>
  );
}
