import { Button, CloseButton, Select, Textarea, TextInput } from "@mantine/core";
import { IconDeviceFloppy } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { Fragment, type SyntheticEvent, useState } from "react";
import {
  type Motor,
  motorCommands,
  type MotorDraft,
  type MotorForm,
  motorsChanged,
} from "../../../api/motors";
import type { EntryDoc } from "../../../api/types";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import {
  disagreeing,
  draftOf,
  flawOf,
  limits,
  namesOf,
  REMARKS,
  type Typed,
  typedOf,
  unitOf,
} from "./motorDraft";
import classes from "./Motors.module.css";
import { titleOf } from "./places";
import { PlateInputs } from "./PlateInputs";

interface Props {
  form: MotorForm;
  /** The motor that is changed, or the example that a new one begins with; undefined for an empty form. */
  motor: Motor | undefined;
  onDone: (() => void) | undefined;
}

/** A motor as a form: units and limits beside each field, checked with every key. */
export function MotorEditor({ form, motor, onDone }: Props) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const [typed, setTyped] = useState<Typed>(() => typedOf(form, motor, t));
  const [tried, setTried] = useState(false);
  const changes = motor !== undefined && !motor.invented;
  const save = useMutation({
    mutationFn: (draft: MotorDraft) =>
      changes ? motorCommands.change(motor.id, motor.version, draft) : motorCommands.add(draft),
    onSuccess: async (kept) => {
      await motorsChanged();
      onDone?.();
      update({ motor: kept.id });
    },
  });
  const draft = draftOf(form, typed, t);
  const type = (name: string, text: string) => {
    save.reset();
    setTyped({ ...typed, [name]: text });
  };
  const onSubmit = (event: SyntheticEvent) => {
    event.preventDefault();
    setTried(true);
    if (draft !== null && !save.isPending) save.mutate(draft);
  };
  const close = () => (onDone ? onDone() : update({ motor: undefined }));
  const doubts = disagreeing(form, typed);
  return (
    <form onSubmit={onSubmit} noValidate style={{ display: "contents" }} data-testid="motor-form">
      <div className={classes.head}>
        <h2>{changes ? t("page.motors.editing", { motor: titleOf(motor) }) : t("page.motors.new_title")}</h2>
        <CloseButton aria-label={t("page.close")} onClick={close} />
      </div>
      <div className={classes.bar}>
        <Button
          type="submit"
          leftSection={<IconDeviceFloppy size={17} aria-hidden />}
          disabled={tried && draft === null}
          loading={save.isPending}
          data-testid="motor-save"
        >
          {t(changes ? "page.motors.save_version" : "page.motors.save")}
        </Button>
        <Button variant="default" onClick={close}>
          {t("page.cancel")}
        </Button>
        <span className="dim">{t("page.motors.only_kept")}</span>
      </div>
      <div className={classes.body}>
        {save.isError && <ProblemAlert error={save.error} title={t("page.motors.refused")} />}
        {doubts.length > 0 && (
          <p className={classes.note} data-testid="motor-disagrees">
            {t("page.motors.disagrees", {
              fields: doubts.map((field) => t(`motor.field.${field.name}`)).join(", "),
            })}
          </p>
        )}
        <PlateInputs form={form} typed={typed} onType={type} tried={tried} />
        <h3>{t("page.motors.parameters")}</h3>
        <div className={classes.fields}>
          {groupsOf(form.description.entries).map((group) => (
            <Fragment key={group[0]?.address}>
              {group[0]?.kind === "record" && <h4>{t.nameOf(group[0].object_name)}</h4>}
              {group.map((entry) => (
                <ParameterInput key={entry.address} form={form} entry={entry} typed={typed} onType={type} />
              ))}
            </Fragment>
          ))}
        </div>
        <h3>{t("page.motors.column.remarks")}</h3>
        <Textarea
          aria-label={t("page.motors.column.remarks")}
          autosize
          minRows={2}
          maxLength={2000}
          value={typed[REMARKS] ?? ""}
          onChange={(event) => type(REMARKS, event.currentTarget.value)}
          data-testid="motor-field-remarks"
        />
      </div>
    </form>
  );
}

/** What stands alone first, then one group a record. */
function groupsOf(entries: readonly EntryDoc[]): EntryDoc[][] {
  const records = new Map<string, EntryDoc[]>([["", []]]);
  for (const entry of entries) {
    const name = entry.kind === "record" ? entry.object_name : "";
    records.set(name, [...(records.get(name) ?? []), entry]);
  }
  return [...records.values()];
}

interface InputProps {
  form: MotorForm;
  entry: EntryDoc;
  typed: Typed;
  onType: (name: string, text: string) => void;
}

function ParameterInput({ form, entry, typed, onType }: InputProps) {
  const t = useTexts();
  const own = entry.restore !== "copy";
  const label = `${entry.address} ${t.nameOf(entry.name)}`;
  const names = namesOf(form, entry);
  const text = typed[entry.address] ?? "";
  if (names) {
    return (
      <Select
        label={label}
        data={names.values.map((one) => ({ value: `raw:${one.value}`, label: t(one.text_key) }))}
        value={text === "" ? null : text}
        clearable
        onChange={(chosen) => onType(entry.address, chosen ?? "")}
        data-testid={`motor-field-${entry.address}`}
      />
    );
  }
  const unit = unitOf(entry);
  const allowed = t("page.entry.allowed", { limits: limits(form, entry, t), unit }).trim();
  return (
    <TextInput
      label={label}
      description={own ? t("page.motors.of_machine_why") : allowed}
      inputWrapperOrder={["label", "input", "error", "description"]}
      error={flawOf(form, entry.address, typed, t)}
      inputMode="decimal"
      autoComplete="off"
      rightSection={
        unit === "" ? null : (
          <span className="dim" style={{ fontSize: 13.5 }}>
            {unit}
          </span>
        )
      }
      rightSectionWidth={unit === "" ? 0 : 60}
      rightSectionPointerEvents="none"
      value={text}
      onChange={(event) => onType(entry.address, event.currentTarget.value)}
      data-testid={`motor-field-${entry.address}`}
    />
  );
}
