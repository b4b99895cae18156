/** What is typed in the form of a motor: texts by field and address, read and checked with every key. */
import type { Motor, MotorDraft, MotorForm, Plate, PlateField } from "../../../api/motors";
import type { EntryDoc } from "../../../api/types";
import { titleOf } from "../../../model/rows";
import { limitText } from "../../../model/shown";
import { isHex, localise, Misfit, parse, quantityOf, show } from "../../../model/values";
import type { Translate } from "../../../texts/texts";

/** Texts as they stand in the fields: `maker`, fields of the plate, addresses of parameters. */
export type Typed = Readonly<Record<string, string>>;

export const NAMES = ["maker", "type"] as const;
export const REMARKS = "remarks";
const NUMBER = /^[-+]?\d+(?:[.,]\d+)?$/;
const UNKNOWN = () => null;

/** The form as it begins with a motor; with a template maker and type are left for the person to type. */
export function typedOf(form: MotorForm, motor: Motor | undefined, t: Translate): Typed {
  const typed: Record<string, string> = {};
  if (!motor) return typed;
  if (!motor.invented) {
    typed.maker = motor.maker;
    typed.type = motor.type;
    typed[REMARKS] = motor.remarks;
  }
  for (const field of form.plate) typed[field.name] = plateText(field, motor.plate, t);
  for (const entry of form.description.entries) {
    const raw = motor.values[entry.address];
    if (raw !== undefined)
      typed[entry.address] = namesOf(form, entry) ? `raw:${raw}` : show(entry, raw, UNKNOWN, t.language);
  }
  return typed;
}

/** Text of a field of the plate, without its unit; "" where it says nothing. */
export function plateText(field: PlateField, plate: Plate, t: Translate): string {
  const found = plate[field.name as keyof Plate];
  return found == null ? "" : typeof found === "number" ? localise(String(found), t.language) : found;
}

/** The names of an enumeration, for a choice in place of a number. */
export function namesOf(form: MotorForm, entry: EntryDoc) {
  return entry.enumeration === null ? undefined : form.description.enumerations[entry.enumeration];
}

/** What is wrong with a field, in words; null where it fits, or where nothing is typed that need not be. */
export function flawOf(form: MotorForm, name: string, typed: Typed, t: Translate): string | null {
  const text = (typed[name] ?? "").trim();
  const field = form.plate.find((one) => one.name === name);
  if (field) return plateFlaw(field, text, t);
  const entry = form.description.entries.find((one) => one.address === name);
  if (entry) return text === "" ? null : entryFlaw(form, entry, text, t);
  return text === "" && name !== REMARKS ? t("motor.flaw.missing") : null;
}

function plateFlaw(field: PlateField, text: string, t: Translate): string | null {
  if (field.text || text === "") return null;
  if (!NUMBER.test(text)) return t("page.misfit.no_number");
  const number = numberOf(text);
  const decimals = /[.,](\d*?)0*$/.exec(text)?.[1]?.length ?? 0;
  if (number < (field.minimum ?? -Infinity) || number > (field.maximum ?? Infinity))
    return t("motor.flaw.range", {
      minimum: localise(String(field.minimum), t.language),
      maximum: localise(String(field.maximum), t.language),
      unit: field.unit,
    });
  return decimals > field.decimals ? t("motor.flaw.decimals", { decimals: field.decimals }) : null;
}

function entryFlaw(form: MotorForm, entry: EntryDoc, text: string, t: Translate): string | null {
  const parsed = parse(form.description, entry, text, UNKNOWN);
  if (parsed.ok || parsed.why === Misfit.Empty) return null;
  const { unit } = quantityOf(entry, UNKNOWN);
  return t(`page.misfit.${parsed.why}`, {
    limits: limits(form, entry, t),
    unit: isHex(entry) ? "" : unit,
    step: show(entry, 1, UNKNOWN, t.language),
  }).trim();
}

/** `0.0 … 200.0` of a parameter. */
export function limits(form: MotorForm, entry: EntryDoc, t: Translate): string {
  return limitText(entry, { slug: "", node: 0, doc: form.description, lookup: UNKNOWN, t }, true);
}

/** Name and unit of a parameter for a label: `nominal voltage`. */
export const labelOf = (entry: EntryDoc, t: Translate): string => titleOf(entry, t);

export const unitOf = (entry: EntryDoc): string => (isHex(entry) ? "" : quantityOf(entry, UNKNOWN).unit);

const numberOf = (text: string): number => Number(text.replace(",", "."));

/** What is sent; null while anything does not fit. */
export function draftOf(form: MotorForm, typed: Typed, t: Translate): MotorDraft | null {
  const names = [
    ...NAMES,
    REMARKS,
    ...form.plate.map((field) => field.name),
    ...form.description.entries.map((entry) => entry.address),
  ];
  if (names.some((name) => flawOf(form, name, typed, t) !== null)) return null;
  const text = (name: string) => (typed[name] ?? "").trim();
  const plate = Object.fromEntries(
    form.plate.map((field) => [
      field.name,
      field.text ? text(field.name) : text(field.name) === "" ? null : numberOf(text(field.name)),
    ]),
  );
  const values: Record<string, number> = {};
  for (const entry of form.description.entries) {
    const parsed = parse(form.description, entry, text(entry.address), UNKNOWN);
    if (parsed.ok) values[entry.address] = Number(parsed.raw);
  }
  return { maker: text("maker"), type: text("type"), remarks: text(REMARKS), plate, values } as MotorDraft;
}

/** Fields of the plate whose parameter says another number, as they are typed now. */
export function disagreeing(form: MotorForm, typed: Typed): PlateField[] {
  return form.plate.filter((field) => {
    const entry = form.description.entries.find((one) => one.address === field.address);
    const plate = (typed[field.name] ?? "").trim();
    if (!entry || !NUMBER.test(plate)) return false;
    const parsed = parse(form.description, entry, (typed[entry.address] ?? "").trim(), UNKNOWN);
    const { scale, unit } = quantityOf(entry, UNKNOWN);
    const factor = unit === `m${field.unit}` ? 1000 : 1;
    return (
      parsed.ok &&
      Math.round((numberOf(plate) * factor * Number(scale.den)) / Number(scale.num)) !== Number(parsed.raw)
    );
  });
}
