/** The signs of a comparison: never colour alone, each with its own shape and its own words. */
import {
  IconAnchor,
  IconBan,
  IconBuildingFactory2,
  IconCircleDashed,
  IconCircleDotted,
  IconDatabaseOff,
  IconEqual,
  IconEqualNot,
  IconEyeOff,
  IconFileOff,
  IconNetwork,
  IconPlugOff,
  IconRulerOff,
} from "@tabler/icons-react";
import type { RowDoc, RowState } from "../../../api/compare";
import { useTexts } from "../../../texts/texts";
import classes from "./Compare.module.css";

const PX = 16;

export const ROW_SIGNS = {
  same: IconEqual,
  different: IconEqualNot,
  unit: IconAnchor,
  missing: IconCircleDashed,
  "not-comparable": IconRulerOff,
} satisfies Record<RowState, typeof IconEqual>;

export function RowSign({ state }: { state: RowState }) {
  const t = useTexts();
  const Icon = ROW_SIGNS[state];
  const text = t(`page.compare.row.${state}`);
  return (
    <span className={classes.sign} data-state={state} title={text}>
      <Icon size={PX + 2} aria-hidden />
      <span className="visually-hidden">{text}</span>
    </span>
  );
}

const ABSENCES = {
  "not-in-set": IconFileOff,
  "not-on-device": IconPlugOff,
  unread: IconEyeOff,
  empty: IconDatabaseOff,
  "no-default": IconCircleDotted,
} as const;

export type Absence = keyof typeof ABSENCES;

/** Why there is no value: each reason with a sign and words of its own. */
export function AbsenceText({ why, reason = "" }: { why: Absence; reason?: string }) {
  const t = useTexts();
  const Icon = ABSENCES[why];
  return (
    <span className={classes.absence} data-why={why} title={reason === "" ? undefined : reason}>
      <Icon size={PX} aria-hidden />
      <span>{t(`page.compare.absence.${why}`)}</span>
    </span>
  );
}

const CLASS_SIGNS = {
  unit: IconAnchor,
  factory: IconBuildingFactory2,
  network: IconNetwork,
  never: IconBan,
} as const;

/** What a restore makes of the object, where it is not simply copied. */
export function ClassChip({ restore }: { restore: RowDoc["restore"] }) {
  const t = useTexts();
  if (restore === "copy") return null;
  const Icon = CLASS_SIGNS[restore];
  return (
    <span className={classes.chip} data-class={restore} title={t(`page.restore.${restore}`)}>
      <Icon size={14} aria-hidden />
      {t(`page.compare.class.${restore}`)}
    </span>
  );
}
