import { NumberInput, TagsInput, Textarea, TextInput } from "@mantine/core";
import type { IncidentWords } from "../api/incidents";
import { useTexts } from "../texts/texts";
import { timeOfDay } from "../ui/format";
import { dateText, zoneText } from "./clockText";
import classes from "./MarkMoment.module.css";

/** What is being written of a moment; the stretch counts in seconds from it. */
export interface Written {
  title: string;
  notes: string;
  tags: string[];
  beforeS: number | null;
  afterS: number | null;
}

const MS = 3;
const MAX_TITLE = 200;
const MAX_TAGS = 20;

export const writtenOf = (
  one: Pick<IncidentWords, "from_ns" | "to_ns" | "at_ns" | "title" | "notes" | "tags">,
): Written => ({
  title: one.title,
  notes: one.notes,
  tags: one.tags,
  beforeS: seconds(one.at_ns - one.from_ns),
  afterS: seconds(one.to_ns - one.at_ns),
});

const seconds = (ns: number): number => Number((ns / 1e9).toFixed(MS));

/** Both ends in ns; null where that is no stretch around the moment, or a `point` where one will do. */
export function stretchOf(
  { beforeS, afterS }: Written,
  atNs: number,
  point = false,
): { from_ns: number; to_ns: number } | null {
  if (beforeS === null || afterS === null || beforeS < 0 || afterS < 0 || (!point && beforeS + afterS <= 0))
    return null;
  return { from_ns: atNs - beforeS * 1e9, to_ns: atNs + afterS * 1e9 };
}

interface Props {
  atNs: number;
  written: Written;
  onChange: (change: Partial<Written>) => void;
  /** Both ends may be the moment itself. */
  point?: boolean;
}

export function TitleAndNotes({ written, onChange }: Omit<Props, "atNs" | "point">) {
  const t = useTexts();
  return (
    <>
      <TextInput
        label={t("page.mark.title")}
        value={written.title}
        maxLength={MAX_TITLE}
        onChange={(event) => onChange({ title: event.currentTarget.value })}
        required
        data-autofocus
        data-testid="mark-title"
      />
      <Textarea
        label={t("page.mark.notes")}
        value={written.notes}
        onChange={(event) => onChange({ notes: event.currentTarget.value })}
        autosize
        minRows={3}
        maxRows={8}
        data-testid="mark-notes"
      />
      <TagsInput
        label={t("page.mark.tags")}
        description={t("page.mark.tags_how")}
        value={written.tags}
        onChange={(tags) => onChange({ tags })}
        maxTags={MAX_TAGS}
        acceptValueOnBlur
        data-testid="mark-tags"
      />
    </>
  );
}

export function Range({ atNs, written, onChange, point = false }: Props) {
  const t = useTexts();
  const stretch = stretchOf(written, atNs, point);
  const ms = atNs / 1e6;
  const given = (typed: string | number) => (typeof typed === "number" ? typed : null);
  return (
    <fieldset className={classes.range}>
      <legend>{t("page.mark.range")}</legend>
      <p className={classes.hint}>
        {t("page.mark.moment", { time: `${dateText(ms)} ${timeOfDay(ms)} ${zoneText(ms)}` })}
      </p>
      <NumberInput
        label={t("page.mark.before")}
        value={written.beforeS ?? ""}
        onChange={(typed) => onChange({ beforeS: given(typed) })}
        min={0}
        decimalScale={MS}
        decimalSeparator={t.language === "de" ? "," : "."}
        hideControls
        data-testid="mark-before"
      />
      <NumberInput
        label={t("page.mark.after")}
        value={written.afterS ?? ""}
        onChange={(typed) => onChange({ afterS: given(typed) })}
        min={0}
        decimalScale={MS}
        decimalSeparator={t.language === "de" ? "," : "."}
        hideControls
        data-testid="mark-after"
      />
      <p className={classes.hint} data-testid="mark-stretch">
        {stretch === null
          ? t("page.mark.no_range")
          : t("page.mark.stretch", {
              from: timeOfDay(stretch.from_ns / 1e6),
              to: timeOfDay(stretch.to_ns / 1e6),
            })}
      </p>
    </fieldset>
  );
}
