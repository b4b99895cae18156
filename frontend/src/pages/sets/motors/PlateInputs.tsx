import { TextInput } from "@mantine/core";
import type { MotorForm, PlateField } from "../../../api/motors";
import { localise } from "../../../model/values";
import { type Translate, useTexts } from "../../../texts/texts";
import { flawOf, NAMES, type Typed } from "./motorDraft";
import classes from "./Motors.module.css";

interface Props {
  form: MotorForm;
  typed: Typed;
  onType: (name: string, text: string) => void;
  /** Somebody wanted to save: what is missing is said now, not before. */
  tried: boolean;
}

/** Maker, type and plate data, with units and limits. */
export function PlateInputs({ form, typed, onType, tried }: Props) {
  const t = useTexts();
  return (
    <>
      <div className={classes.fields}>
        {NAMES.map((name) => (
          <TextInput
            key={name}
            label={t(`motor.field.${name}`)}
            withAsterisk
            error={tried ? flawOf(form, name, typed, t) : null}
            maxLength={80}
            autoComplete="off"
            value={typed[name] ?? ""}
            onChange={(event) => onType(name, event.currentTarget.value)}
            data-testid={`motor-field-${name}`}
          />
        ))}
      </div>
      <h3>{t("page.motors.plate")}</h3>
      <div className={classes.fields}>
        {form.plate.map((field) => (
          <TextInput
            key={field.name}
            label={t(`motor.field.${field.name}`)}
            description={allowed(field, t)}
            inputWrapperOrder={["label", "input", "error", "description"]}
            error={flawOf(form, field.name, typed, t)}
            inputMode={field.text ? "text" : "decimal"}
            maxLength={80}
            autoComplete="off"
            rightSection={
              field.unit === "" ? null : (
                <span className="dim" style={{ fontSize: 13.5 }}>
                  {field.unit}
                </span>
              )
            }
            rightSectionWidth={field.unit === "" ? 0 : 60}
            rightSectionPointerEvents="none"
            value={typed[field.name] ?? ""}
            onChange={(event) => onType(field.name, event.currentTarget.value)}
            data-testid={`motor-field-${field.name}`}
          />
        ))}
      </div>
    </>
  );
}

function allowed(field: PlateField, t: Translate): string | undefined {
  if (field.text) return undefined;
  const side = (number: number | null) => localise(String(number), t.language);
  const limits = `${side(field.minimum)} … ${side(field.maximum)}`;
  return t("page.entry.allowed", { limits, unit: field.unit }).trim();
}
