import { TextInput } from "@mantine/core";
import { NeedsRole } from "../../../../frame/NeedsRole";
import { isBroken, lineOfFinding } from "../../../../model/ruleFindings";
import { type DeviceContext, lineOf, shownOf } from "../../../../model/shown";
import { quantityOf } from "../../../../model/values";
import { useShown } from "../../../../live/live";
import { ReadingText } from "../../../../ui/ReadingText";
import { entriesOf } from "../../../../ui/reading";
import { draftOf } from "../../../parameters/draft";
import { useFindingsOf } from "../../../parameters/rules";
import { stage, unstage, useChange } from "../../../parameters/staging";
import { useState } from "react";
import type { EntryDoc } from "../../../../api/types";
import classes from "./Battery.module.css";

interface Props {
  context: DeviceContext | null;
  address: string;
}

/** A setting: what the unit holds, and a field whose text becomes a pending change as soon as it fits. */
export function StagedField({ context, address }: Props) {
  const entry = context ? entriesOf(context.doc).get(address) : undefined;
  if (!context || !entry) return null;
  return <Field key={`${context.slug} ${address}`} context={context} entry={entry} />;
}

function Field({ context, entry }: { context: DeviceContext; entry: EntryDoc }) {
  const { t, slug } = context;
  const { recorded } = useShown();
  const change = useChange(slug, entry.address);
  const [text, setText] = useState("");
  const typed = draftOf(entry, context, text);
  const pending = change === undefined ? null : shownOf(entry, change.raw, context);
  // What was staged elsewhere, or before a reload, stands in the field as if it had been typed here.
  const ours = text !== "" && (typed.error !== null || typed.raw === change?.raw);
  const broken = useFindingsOf(entry, context, change?.raw ?? null).find(isBroken);
  const type = (next: string) => {
    setText(next);
    const { raw } = draftOf(entry, context, next);
    if (raw !== null) stage(entry, raw, [context]);
    else unstage(entry, [context]);
  };
  const unit = quantityOf(entry, context.lookup).unit;
  return (
    <div className={classes.setting} data-testid={`setting-${entry.address}`}>
      <span className={classes.settingName}>
        {t.nameOf(entry.title)}
        <ReadingText context={context} address={entry.address} pace="kept" />
        {pending !== null && <strong className="tone-warning">→ {lineOf(pending)}</strong>}
      </span>
      {!recorded && entry.writable && (
        <NeedsRole role="technician" device>
          {(locked) => (
            <TextInput
              value={ours ? text : (pending?.text ?? "")}
              onChange={(event) => type(event.currentTarget.value)}
              disabled={locked}
              error={text !== "" && typed.error !== null}
              inputMode="decimal"
              w={118}
              rightSection={<span className="dim">{unit}</span>}
              aria-label={t("page.setup.battery.new_value", { name: t.nameOf(entry.title) })}
              aria-describedby={`note-${entry.address}`}
              data-testid={`field-${entry.address}`}
            />
          )}
        </NeedsRole>
      )}
      <small id={`note-${entry.address}`} data-error={typed.error !== null} className={classes.note}>
        {typed.error ?? (broken ? lineOfFinding(broken, t) : typed.hint)}
      </small>
    </div>
  );
}
