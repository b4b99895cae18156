import { Button, SegmentedControl, Select, TextInput } from "@mantine/core";
import { IconBug, IconCircleCheck, IconHourglass } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import type { SyntheticEvent } from "react";
import { type FaultKind, type FaultParameter, instructing } from "../../api/instructor";
import { NeedsRole } from "../../frame/NeedsRole";
import { usePageSearch } from "../../frame/search";
import { useTexts } from "../../texts/texts";
import { ProblemAlert } from "../../ui/ProblemAlert";
import { useTyped } from "../../ui/useTyped";
import {
  DURATION,
  fieldsOf,
  flawOf,
  limitsOf,
  numberOf,
  numberText,
  orderOf,
  shownIn,
  textOf,
  type Typed,
  typedOf,
} from "./draft";
import classes from "./Instructor.module.css";
import { choicesOf, parameterName, useNodeChoices, useWhere } from "./names";
import { Target, usePlace } from "./Target";

/** As many letters of choices still stand side by side. */
const MOST_LETTERS = 20;

/** One kind of fault: what it does, where, with which values, for how long. One click injects it. */
export function FaultForm({ kind, answering }: { kind: FaultKind; answering: boolean }) {
  const t = useTexts();
  const where = useWhere();
  const [search, update] = usePageSearch();
  const [text, setText] = useTyped(search.set ?? "", (set) => update({ set }));
  const typed = typedOf(text);
  const nodes = useNodeChoices();
  const place = usePlace(kind, nodes);
  const order = place === null ? null : orderOf(kind, place, typed);
  const name = t(`fault.${kind.id}.name`);
  const inject = useMutation({ mutationFn: instructing.inject });
  const type = (field: string, value: string | undefined) => {
    const next = new Map(typed);
    if (value === undefined) next.delete(field);
    else next.set(field, value);
    inject.reset();
    setText(textOf(next));
  };
  const submit = (event: SyntheticEvent) => {
    event.preventDefault();
    if (order !== null && answering && !inject.isPending) inject.mutate(order);
  };
  return (
    <section className={classes.form} aria-label={name} data-testid="fault-form" data-kind={kind.id}>
      <h2>{name}</h2>
      <p className={classes.hint}>{t(`fault.${kind.id}.hint`)}</p>
      <form onSubmit={submit} noValidate>
        <Target kind={kind} nodes={nodes} place={place} />
        <div className={classes.fields}>
          {fieldsOf(kind).map((field) => (
            <Field key={field.name} field={field} typed={typed} onType={type} />
          ))}
        </div>
        <div className={classes.go}>
          <NeedsRole role="technician" device>
            {(locked) => (
              <Button
                type="submit"
                color="var(--hs-twin)"
                leftSection={<IconBug size={18} aria-hidden />}
                disabled={locked || !answering || order === null}
                loading={inject.isPending}
                data-testid="inject"
              >
                {t("page.instructor.inject")}
              </Button>
            )}
          </NeedsRole>
          {kind.momentary && (
            <span className={classes.momentary} data-testid="momentary">
              <IconHourglass size={17} aria-hidden /> {t("page.instructor.momentary")}
            </span>
          )}
        </div>
        {inject.data && (
          <p className={`${classes.done} tone-ok`} role="status" data-testid="injected-told">
            <IconCircleCheck size={19} aria-hidden />
            {t("page.instructor.injected", {
              fault: name,
              place: where(inject.data, kind.target === "bus"),
            })}{" "}
            {t(kind.momentary ? "page.instructor.injected_momentary" : "page.instructor.injected_next")}
          </p>
        )}
        {inject.error !== null && (
          <ProblemAlert error={inject.error} title={t("page.instructor.refused", { fault: name })} />
        )}
      </form>
    </section>
  );
}

interface FieldProps {
  field: FaultParameter;
  typed: Typed;
  onType: (field: string, value: string | undefined) => void;
}

function Field({ field, typed, onType }: FieldProps) {
  const t = useTexts();
  const label = parameterName(field, t);
  const choices = choicesOf(field, t);
  if (choices.length > 1) {
    const value = String(numberOf(shownIn(field, typed, t.language)) ?? field.default);
    const data = choices.map((one) => ({ value: String(one.value), label: one.name }));
    const onChange = (chosen: string | null) =>
      onType(field.name, chosen === null || Number(chosen) === field.default ? undefined : chosen);
    if (choices.map((one) => one.name).join("").length > MOST_LETTERS) {
      return (
        <Select
          label={label}
          data={data}
          value={value}
          onChange={onChange}
          allowDeselect={false}
          data-testid={`value-${field.name}`}
        />
      );
    }
    return (
      <div>
        <span className={classes.label}>{label}</span>
        <SegmentedControl
          className={classes.segments ?? ""}
          fullWidth
          data={data}
          value={value}
          onChange={onChange}
          aria-label={label}
          data-testid={`value-${field.name}`}
        />
      </div>
    );
  }
  return <NumberField field={field} typed={typed} onType={onType} label={label} />;
}

function NumberField({ field, typed, onType, label }: FieldProps & { label: string }) {
  const t = useTexts();
  const text = shownIn(field, typed, t.language);
  const flaw = flawOf(field, text);
  const limits = limitsOf(field, t.language);
  const usual = numberText(field, field.default, t.language);
  return (
    <TextInput
      label={label}
      inputWrapperOrder={["label", "input", "error", "description"]}
      description={
        field === DURATION
          ? t("page.instructor.seconds_hint")
          : t("page.instructor.limits", { limits, usual: `${usual} ${field.unit}`.trim() })
      }
      placeholder={field === DURATION ? t("page.instructor.until_cleared") : usual}
      error={flaw === null ? undefined : t(`page.instructor.flaw.${flaw}`, { limits })}
      inputMode="decimal"
      autoComplete="off"
      rightSection={field.unit === "" ? null : <span className="dim">{field.unit}</span>}
      rightSectionWidth={field.unit === "" ? 0 : 46}
      rightSectionPointerEvents="none"
      value={text}
      onChange={(event) => onType(field.name, event.currentTarget.value)}
      data-testid={`value-${field.name}`}
    />
  );
}
