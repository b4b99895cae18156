import { IconAlertTriangle } from "@tabler/icons-react";
import type { Motor, MotorForm, MotorList } from "../../../api/motors";
import type { EntryDoc } from "../../../api/types";
import { shownOf, lineOf } from "../../../model/shown";
import { type Translate, useTexts } from "../../../texts/texts";
import { dateAndTime } from "../../../ui/format";
import { Pairs } from "../../recordings/RecordingDetails";
import { originText } from "./MotorList";
import { labelOf, plateText } from "./motorDraft";
import classes from "./Motors.module.css";
import { devicesOf } from "./places";

interface Props {
  motor: Motor;
  list: MotorList;
  form: MotorForm;
}

/** Plate, parameters with their units, where they come from, and who drives it. */
export function MotorContent({ motor, list, form }: Props) {
  const t = useTexts();
  return (
    <>
      {motor.invented && <p className={classes.note}>{t("page.motors.invented_note")}</p>}
      {motor.disagreements.length > 0 && (
        <p className={classes.note} data-testid="motor-disagrees">
          {t("page.motors.disagrees", {
            fields: motor.disagreements.map((name) => t(`motor.field.${name}`)).join(", "),
          })}
        </p>
      )}
      <h3>{t("page.motors.plate")}</h3>
      <PlateData motor={motor} form={form} />
      {motor.remarks !== "" && (
        <>
          <h3>{t("page.motors.column.remarks")}</h3>
          <p className={classes.remarks}>{motor.remarks}</p>
        </>
      )}
      <h3>{t("page.motors.parameters")}</h3>
      <Parameters motor={motor} form={form} />
      <h3>{t("page.motors.history")}</h3>
      <Pairs
        pairs={[
          [t("page.motors.column.source"), originText(motor, t)],
          [
            t("page.motors.column.changed"),
            motor.invented ? "–" : `${dateAndTime(motor.t_ns / 1e6)} ${motor.person}`,
          ],
          [
            t("page.motors.column.devices"),
            devicesOf(list, motor.id)
              .map((one) => one.device)
              .join(", ") || "–",
          ],
          ["ID", motor.id],
        ]}
      />
    </>
  );
}

function PlateData({ motor, form }: Omit<Props, "list">) {
  const t = useTexts();
  return (
    <dl className={classes.plate} data-testid="motor-plate">
      {form.plate.map((field) => {
        const text = plateText(field, motor.plate, t);
        return (
          <div key={field.name}>
            <dt>{t(`motor.field.${field.name}`)}</dt>
            <dd>
              {text === "" ? "–" : `${text} ${field.unit}`.trim()}{" "}
              {motor.disagreements.includes(field.name) && (
                <IconAlertTriangle
                  size={14}
                  className="tone-warning"
                  aria-label={t("motor.state.different")}
                />
              )}
            </dd>
          </div>
        );
      })}
    </dl>
  );
}

function Parameters({ motor, form }: Omit<Props, "list">) {
  const t = useTexts();
  return (
    <table className={classes.values} data-testid="motor-values">
      <thead>
        <tr>
          <th>{t("page.table.column.address")}</th>
          <th>{t("page.table.column.name")}</th>
          <th data-number="true">{t("page.motors.value")}</th>
        </tr>
      </thead>
      <tbody>
        {form.description.entries.map((entry) => {
          const raw = motor.values[entry.address];
          return (
            <tr key={entry.address} data-testid={`motor-value-${entry.address}`}>
              <td>{entry.address}</td>
              <td>
                {labelOf(entry, t)}{" "}
                {entry.restore !== "copy" && (
                  <span className={classes.plain} title={t("page.motors.of_machine_why")}>
                    {t("page.motors.of_machine")}
                  </span>
                )}
              </td>
              <td
                data-number="true"
                title={raw === undefined ? undefined : t("page.entry.raw_only", { raw })}
              >
                {wordsOf(form, entry, raw, t)}
              </td>
            </tr>
          );
        })}
      </tbody>
    </table>
  );
}

/** A value of a motor with its unit, or its name; a dash where the motor does not hold it. */
export function wordsOf(
  form: MotorForm,
  entry: EntryDoc,
  raw: number | null | undefined,
  t: Translate,
): string {
  if (raw == null) return "–";
  const context = { slug: "", node: 0, doc: form.description, lookup: () => null, t };
  return lineOf(shownOf(entry, raw, context));
}
