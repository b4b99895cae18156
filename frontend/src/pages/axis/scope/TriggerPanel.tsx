import { NumberInput, SegmentedControl, Select, TextInput } from "@mantine/core";
import { useTexts } from "../../../texts/texts";
import { typedNumber } from "../../../ui/typedNumber";
import { codeOf, type Draft, type EventKind, type Kind } from "./draft";
import type { Options } from "./options";
import classes from "./Scope.module.css";

const KINDS: readonly Kind[] = ["manual", "edge", "level", "event", "fault"];
const EVENTS: readonly EventKind[] = ["axis_state", "bit", "emcy", "boot_up", "nmt"];
const ANY = "any";

interface Props {
  draft: Draft;
  options: Options;
  chosen: readonly string[];
  locked: boolean;
  onChange: (change: Partial<Draft>) => void;
}

/** What the scope waits for, and how long a capture is. */
export function TriggerPanel({ draft, options, chosen, locked, onChange }: Props) {
  const t = useTexts();
  return (
    <fieldset className={classes.panel} disabled={locked}>
      <legend className={classes.hidden}>{t("page.scope.tab_trigger")}</legend>
      <Select
        label={t("page.scope.trigger_kind")}
        data={KINDS.map((kind) => ({ value: kind, label: t(`page.scope.kind_${kind}`) }))}
        value={draft.kind}
        onChange={(kind) => kind !== null && onChange({ kind })}
        allowDeselect={false}
        data-testid="trigger-kind"
      />
      <OfKind {...{ draft, options, chosen, locked, onChange }} />
      <div className={classes.pair}>
        <Seconds
          label={t("page.scope.total")}
          value={draft.totalS}
          take={(totalS) => onChange({ totalS })}
          name="total"
        />
        <Seconds
          label={t("page.scope.pre")}
          value={draft.preS}
          take={(preS) => onChange({ preS })}
          name="pre"
        />
      </div>
      <p className={classes.told}>
        {t("page.scope.pre_share", {
          percent: Math.round((100 * draft.preS) / Math.max(1e-9, draft.totalS)),
        })}
      </p>
      <Choice
        label={t("page.scope.mode")}
        value={draft.mode}
        names={["single", "normal", "auto"]}
        textOf={(name) => t(`page.scope.mode_${name}`)}
        take={(mode) => onChange({ mode })}
      />
      <p className={classes.told}>{t(`page.scope.mode_${draft.mode}_explain`)}</p>
      <div className={classes.pair}>
        {draft.mode !== "single" && (
          <Seconds
            label={t("page.scope.hold_off")}
            value={draft.holdOffS}
            take={(holdOffS) => onChange({ holdOffS })}
            name="hold-off"
          />
        )}
        {draft.mode === "auto" && (
          <Seconds
            label={t("page.scope.auto_after")}
            value={draft.autoS}
            take={(autoS) => onChange({ autoS })}
            name="auto"
          />
        )}
      </div>
    </fieldset>
  );
}

function OfKind({ draft, options, chosen, locked, onChange }: Props) {
  const t = useTexts();
  const { kind } = draft;
  if (kind === "manual") return <p className={classes.told}>{t("page.scope.manual_explain")}</p>;
  if (kind === "edge" || kind === "level") {
    const option = draft.signal === null ? undefined : options.byName.get(draft.signal);
    const unit = option?.unit ?? "";
    return (
      <>
        <TriggerSignal {...{ draft, options, chosen, onChange }} bits={null} />
        {option?.bit == null && (
          <Seconds
            label={unit === "" ? t("page.scope.trigger_level") : t("page.scope.trigger_level_unit", { unit })}
            value={draft.level}
            take={(level) => onChange({ level })}
            name="level"
          />
        )}
        {kind === "edge" ? (
          <Choice
            label={t("page.scope.slope")}
            value={draft.slope}
            names={["rising", "falling", "either"]}
            textOf={(name) => t(`page.scope.slope_${name}`)}
            take={(slope) => onChange({ slope })}
          />
        ) : (
          <Choice
            label={t("page.scope.side_of")}
            value={draft.side}
            names={["above", "below"]}
            textOf={(name) => t(`page.scope.side_${name}`)}
            take={(side) => onChange({ side })}
          />
        )}
      </>
    );
  }
  return (
    <>
      {kind === "fault" && <p className={classes.told}>{t("page.scope.fault_explain")}</p>}
      {kind === "event" && (
        <Select
          label={t("page.scope.event")}
          data={EVENTS.map((event) => ({ value: event, label: t(`page.scope.event_${event}`) }))}
          value={draft.event}
          onChange={(event) => event !== null && onChange({ event })}
          allowDeselect={false}
          data-testid="trigger-event"
        />
      )}
      {kind === "event" && draft.event === "bit" ? (
        <TriggerSignal {...{ draft, options, chosen, onChange }} bits />
      ) : (
        <Select
          label={t("page.scope.device")}
          data={[{ value: ANY, label: t("page.scope.device_any") }, ...devicesOf(draft, options)]}
          value={draft.device ?? ANY}
          onChange={(device) => onChange({ device: device === ANY ? null : device })}
          allowDeselect={false}
          disabled={locked}
          data-testid="trigger-device"
        />
      )}
      {kind === "fault" && (
        <TextInput
          label={t("page.scope.code")}
          placeholder={t("page.scope.code_any")}
          value={draft.code}
          onChange={(event) => onChange({ code: event.currentTarget.value })}
          error={codeOf(draft.code) === undefined ? t("page.scope.code_wrong") : undefined}
          data-testid="trigger-code"
        />
      )}
    </>
  );
}

const devicesOf = (draft: Draft, options: Options) =>
  draft.kind === "event" && draft.event === "axis_state"
    ? options.devices.filter(({ value }) => options.axes.includes(value))
    : [...options.devices];

interface SignalProps extends Pick<Props, "draft" | "options" | "chosen" | "onChange"> {
  /** Only bits; null: any of the chosen signals. */
  bits: true | null;
}

function TriggerSignal({ draft, options, chosen, onChange, bits }: SignalProps) {
  const t = useTexts();
  const names = new Set([...chosen, ...(draft.signal === null ? [] : [draft.signal])]);
  const data = [...names].flatMap((name) => {
    const option = options.byName.get(name);
    return option && (bits === null || option.bit !== null)
      ? [{ value: name, label: `${option.place} ${option.title}` }]
      : [];
  });
  return (
    <Select
      label={t("page.scope.trigger_signal")}
      data={data}
      value={draft.signal}
      onChange={(signal) => onChange({ signal })}
      error={data.length === 0 ? t("page.scope.chosen_none") : undefined}
      data-testid="trigger-signal"
    />
  );
}

function Seconds(props: { label: string; value: number; take: (value: number) => void; name: string }) {
  const { language } = useTexts();
  return (
    <NumberInput
      label={props.label}
      value={props.value}
      onChange={(typed) => typedNumber(typed, props.take)}
      decimalSeparator={language === "de" ? "," : "."}
      hideControls
      data-testid={`scope-${props.name}`}
    />
  );
}

interface ChoiceProps<Name extends string> {
  label: string;
  value: Name;
  names: readonly Name[];
  textOf: (name: Name) => string;
  take: (name: Name) => void;
}

function Choice<Name extends string>({ label, value, names, textOf, take }: ChoiceProps<Name>) {
  return (
    <div>
      <span className={classes.label}>{label}</span>
      <SegmentedControl
        fullWidth
        aria-label={label}
        value={value}
        onChange={(name) => take(name)}
        data={names.map((name) => ({ value: name, label: textOf(name) }))}
      />
    </div>
  );
}
