import { Button, SegmentedControl } from "@mantine/core";
import type { DeviceContext } from "../../../../model/shown";
import { hexadecimal } from "../../../../model/values";
import { type Translate, useTexts } from "../../../../texts/texts";
import { useReading } from "../../../../ui/reading";
import { Findings, findingsOf } from "../common/Findings";
import { type Parameter, setRaw, type Setup } from "../common/parameter";
import { type Alarm, type AlarmBits, alarmOf, bitsOf, clampsOf, isActive, maskOf } from "./alarm";
import classes from "./Masks.module.css";
import { hasBit } from "./matrix";

const NUMBERS = [1, 2, 3, 4, 5, 6, 7, 8];
const TABLE = "alarm_input_mask";
const INPUTS = "30FD";
const addressOf = (number: number): string => `3300:0${number}`;
export const ALARMS: readonly string[] = NUMBERS.map(addressOf);

interface Props {
  unit: DeviceContext;
  setup: Setup;
}

/** The eight alarms that inputs can raise: which input, at which level, as fault or as warning. */
export function AlarmInputs({ unit, setup }: Props) {
  const t = useTexts();
  const bits = bitsOf(unit.doc.bit_tables[TABLE] ?? []);
  const reading = useReading(unit, INPUTS, "slow");
  const levels = typeof reading?.raw === "number" && !reading.stale ? reading.raw : null;
  const parameters = NUMBERS.map((number) => setup.of(unit, addressOf(number)));
  if (!bits) return null;
  return (
    <section className={classes.panel} aria-labelledby="setup-alarms">
      <h2 id="setup-alarms">{t("page.setup.masks.alarms")}</h2>
      <p className="dim">{t("page.setup.masks.alarms_intro")}</p>
      <ol className={classes.alarms}>
        {parameters.map(
          (parameter, at) =>
            parameter && (
              <AlarmRow
                key={parameter.entry.address}
                number={at + 1}
                parameter={parameter}
                bits={bits}
                levels={levels}
              />
            ),
        )}
      </ol>
      <Findings findings={findingsOf(parameters)} />
    </section>
  );
}

interface RowProps {
  number: number;
  parameter: Parameter;
  bits: AlarmBits;
  levels: number | null;
}

function AlarmRow({ number, parameter, bits, levels }: RowProps) {
  const t = useTexts();
  const { raw, ram, change, lock, entry } = parameter;
  const code = `FFF${number}h`;
  if (raw === null)
    return (
      <li data-testid={`alarm-${number}`}>
        <b>{code}</b> <span className="dim">–</span>
      </li>
    );
  const alarm = alarmOf(raw, bits);
  const set = (part: Partial<Alarm>) => setRaw(parameter, maskOf({ ...alarm, ...part }, bits));
  const locked = lock !== null;
  const idle = locked || alarm.inputs.length === 0;
  const name = t("page.setup.masks.alarm.name", { number, code });
  return (
    <li data-pending={change !== undefined} data-testid={`alarm-${number}`}>
      <b title={name}>{code}</b>
      <Inputs
        alarm={alarm}
        bits={bits}
        name={name}
        levels={levels}
        locked={locked}
        number={number}
        onChange={set}
      />
      <SegmentedControl
        aria-label={`${name}: ${t("page.setup.masks.alarm.level")}`}
        value={alarm.highActive ? "high" : "low"}
        disabled={idle}
        onChange={(level) => set({ highActive: level === "high" })}
        data={["low", "high"].map((one) => ({ value: one, label: t(`page.setup.masks.alarm.${one}`) }))}
        data-testid={`alarm-level-${number}`}
      />
      <SegmentedControl
        aria-label={`${name}: ${t("page.setup.masks.alarm.kind")}`}
        value={alarm.fault ? "fault" : "warning"}
        disabled={idle}
        onChange={(kind) => set({ fault: kind === "fault" })}
        data={["warning", "fault"].map((one) => ({ value: one, label: t(`page.setup.masks.alarm.${one}`) }))}
        data-testid={`alarm-kind-${number}`}
      />
      <Button
        variant="subtle"
        px="xs"
        disabled={locked || raw === 0}
        onClick={() => setRaw(parameter, 0)}
        aria-label={`${name}: ${t("page.setup.masks.alarm.clear")}`}
        data-testid={`alarm-clear-${number}`}
      >
        {t("page.setup.masks.alarm.clear")}
      </Button>
      <div className={classes.words}>
        <strong data-testid={`alarm-words-${number}`}>
          {wordsOf(alarm, bits, hexadecimal(entry, raw), t)}
          {change && " ✎"}
        </strong>
        <Now alarm={ram === null ? null : alarmOf(ram, bits)} levels={levels} number={number} kind="now" />
        {change && <Now alarm={alarm} levels={levels} number={number} kind="then" />}
      </div>
    </li>
  );
}

/** The mask in words, and as the device holds it. */
function wordsOf(alarm: Alarm, bits: AlarmBits, hex: string, t: Translate): string {
  if (alarm.inputs.length === 0) return t("page.setup.masks.alarm.inactive", { hex });
  return t("page.setup.masks.alarm.words", {
    clamps: clampsOf(alarm, bits).join(" + "),
    level: t(`page.setup.masks.alarm.${alarm.highActive ? "high" : "low"}`),
    kind: t(`page.setup.masks.alarm.${alarm.fault ? "fault" : "warning"}`),
    hex,
  });
}

interface InputsProps {
  alarm: Alarm;
  bits: AlarmBits;
  name: string;
  levels: number | null;
  locked: boolean;
  number: number;
  onChange: (part: Partial<Alarm>) => void;
}

/** The inputs with the level that each has now. */
function Inputs({ alarm, bits, name, levels, locked, number, onChange }: InputsProps) {
  const t = useTexts();
  return (
    <span
      className={classes.inputs}
      role="group"
      aria-label={`${name}: ${t("page.setup.masks.alarm.inputs")}`}
    >
      {bits.inputs.map(({ bit, clamp }) => {
        const chosen = alarm.inputs.includes(bit);
        const level =
          levels === null ? "–" : t(hasBit(levels, bit) ? "page.setup.masks.on" : "page.setup.masks.off");
        return (
          <button
            key={bit}
            type="button"
            role="checkbox"
            aria-checked={chosen}
            aria-disabled={locked}
            onClick={() => {
              const inputs = chosen ? alarm.inputs.filter((one) => one !== bit) : [...alarm.inputs, bit];
              if (!locked) onChange({ inputs });
            }}
            data-testid={`alarm-input-${number}-${bit}`}
          >
            {clamp} <small>{level}</small>
          </button>
        );
      })}
    </span>
  );
}

interface NowProps {
  alarm: Alarm | null;
  levels: number | null;
  number: number;
  kind: "now" | "then";
}

/** Whether the alarm is raised with the inputs of now: by what RAM holds, or once what is pending was written. */
function Now({ alarm, levels, number, kind }: NowProps) {
  const t = useTexts();
  if (alarm === null || alarm.inputs.length === 0) return null;
  const active = isActive(alarm, levels);
  const state =
    active === null ? (alarm.inputs.length > 1 ? "several" : "unknown") : active ? "active" : "quiet";
  return (
    <span data-state={state} data-testid={`alarm-${kind}-${number}`}>
      {t(`page.setup.masks.alarm.${kind}_${state}`)}
    </span>
  );
}
