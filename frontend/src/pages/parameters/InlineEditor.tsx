import { IconCheck, IconX } from "@tabler/icons-react";
import { type KeyboardEvent, useEffect, useRef, useState } from "react";
import type { EntryDoc } from "../../api/types";
import { quantityOf, isHex, show } from "../../model/values";
import { isBroken, lineOfFinding } from "../../model/ruleFindings";
import type { DeviceContext } from "../../model/shown";
import { useDraft } from "./draft";
import { useFindingsOf } from "./rules";
import classes from "./Parameters.module.css";
import { stage, staged } from "./staging";

interface Props {
  entry: EntryDoc;
  device: DeviceContext;
  onDone: () => void;
}

/** A number edited where it stands: Enter or leaving it makes it pending, arrow keys step it, the cross drops the text. */
export function InlineEditor({ entry, device, onDone }: Props) {
  const { t, slug, lookup } = device;
  const [start] = useState(() => {
    const raw = staged.get(slug, entry.address)?.raw ?? lookup(entry.address);
    return raw === null ? "" : show(entry, raw, lookup, t.language);
  });
  const draft = useDraft(entry, device, start);
  const broken = useFindingsOf(entry, device, draft.raw).find(isBroken);
  const input = useRef<HTMLInputElement>(null);
  useEffect(() => input.current?.select(), []);
  const accept = () => {
    if (draft.raw === null) return;
    stage(entry, draft.raw, [device]);
    onDone();
  };
  const onKeyDown = (event: KeyboardEvent) => {
    event.stopPropagation();
    if (event.key === "Enter") accept();
    else if (event.key === "Escape") onDone();
    else if (event.key === "ArrowUp" || event.key === "ArrowDown")
      draft.step(event.key === "ArrowUp" ? 1 : -1);
    else return;
    event.preventDefault();
  };
  const unit = isHex(entry) ? "" : quantityOf(entry, lookup).unit;
  const leave = () => (draft.raw !== null && draft.text !== start ? accept() : onDone());
  return (
    <span
      className={classes.inline}
      onBlur={(event) => {
        if (!event.currentTarget.contains(event.relatedTarget)) leave();
      }}
    >
      <input
        ref={input}
        autoFocus
        aria-label={t("page.entry.new_value")}
        aria-invalid={draft.error !== null}
        aria-describedby={`inline-note-${entry.address}`}
        value={draft.text}
        inputMode="decimal"
        onChange={(event) => draft.setText(event.currentTarget.value)}
        onKeyDown={onKeyDown}
        data-testid="inline-value"
      />
      <i className="dim">{unit}</i>
      <button
        type="button"
        aria-label={t("page.stage.button")}
        disabled={draft.raw === null}
        onClick={accept}
      >
        <IconCheck size={17} aria-hidden />
      </button>
      <button type="button" aria-label={t("page.cancel")} onClick={onDone}>
        <IconX size={17} aria-hidden />
      </button>
      <span
        id={`inline-note-${entry.address}`}
        className={classes.inlineNote}
        data-error={draft.error !== null}
        data-rule={draft.error === null && broken !== undefined ? broken.severity : undefined}
        role="status"
      >
        {draft.error ?? (broken ? lineOfFinding(broken, t) : draft.hint)}
      </span>
    </span>
  );
}
