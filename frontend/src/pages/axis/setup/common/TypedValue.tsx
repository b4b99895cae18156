import { TextInput } from "@mantine/core";
import { type KeyboardEvent, useState } from "react";
import { useTexts } from "../../../../texts/texts";
import { quantityOf } from "../../../../model/values";
import { draftOf, startText } from "../../../parameters/draft";
import { type Bounds, held, isShut } from "./bounds";
import { type Parameter, setRaw } from "./parameter";
import classes from "./Setup.module.css";
import { stopText } from "./stopText";

interface Props {
  parameter: Parameter;
  name: string;
  /** None where its row has the name already. */
  label?: string;
  bounds: Bounds;
}

/** The number of a mark, typed: taken with Enter or when it is left; what does not fit is refused, with the reason. */
export function TypedValue({ parameter, name, label, bounds }: Props) {
  const t = useTexts();
  const { entry, context, raw, change, lock } = parameter;
  const [typed, setTyped] = useState<string | null>(null);
  const draft = typed === null ? null : draftOf(entry, context, typed);
  const number = typeof draft?.raw === "number" ? draft.raw : null;
  const stop = number === null || isShut(bounds) ? bounds.low : held(number, bounds).by;
  const crossed = number !== null && (isShut(bounds) || held(number, bounds).by !== null);
  const error = crossed ? stopText(parameter, stop, t) : (draft?.error ?? null);
  const accept = () => {
    if (typed?.trim() === "") setTyped(null);
    if (number === null || error !== null) return;
    setRaw(parameter, number);
    setTyped(null);
  };
  const { unit } = quantityOf(entry, context.lookup);
  return (
    <TextInput
      className={classes.typed ?? ""}
      label={label === undefined ? undefined : `${label}${change ? " ✎" : ""}`}
      aria-label={name}
      value={typed ?? startText(entry, raw, context)}
      placeholder="–"
      error={error}
      disabled={lock !== null || (raw === null && typed === null)}
      inputMode="decimal"
      rightSection={<span className={classes.unit}>{unit}</span>}
      rightSectionWidth={28}
      onChange={(event) => setTyped(event.currentTarget.value)}
      onBlur={accept}
      onKeyDown={(event: KeyboardEvent) => {
        if (event.key === "Enter") accept();
      }}
      data-testid={`typed-${entry.address}`}
    />
  );
}
