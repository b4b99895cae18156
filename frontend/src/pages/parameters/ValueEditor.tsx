import { Checkbox, NumberInput, Select, Stack, Text, TextInput } from "@mantine/core";
import { type KeyboardEvent, useState } from "react";
import type { BitDoc, EntryDoc } from "../../api/types";
import { fieldMax, fieldOf, withField } from "../../model/bits";
import { hexadecimal, inForce, isHex, isInteger, quantityOf } from "../../model/values";
import { errorCode } from "../../ui/format";
import { useDevice } from "./context";
import type { Draft } from "./draft";
import classes from "./Parameters.module.css";
import { plannedContext } from "./staging";

interface Props {
  entry: EntryDoc;
  /** The one draft: whatever editor is used, it is this text that is read, checked and made pending. */
  draft: Draft;
}

export function ValueEditor(given: Props) {
  const device = useDevice();
  const { doc } = device;
  // Names and bits as they will be once what is pending is written.
  const entry = inForce(given.entry, plannedContext(device).lookup);
  const props = { ...given, entry };
  if (entry.enumeration !== null && doc.enumerations[entry.enumeration]) return <EnumEditor {...props} />;
  const table = entry.bits === null ? undefined : doc.bit_tables[entry.bits];
  if (table) return <BitsEditor {...props} table={table} />;
  return <TextEditor {...props} />;
}

function TextEditor({ entry, draft }: Props) {
  const { t, lookup } = useDevice();
  const { unit } = quantityOf(entry, lookup);
  const onKeyDown = (event: KeyboardEvent) => {
    if (!isInteger(entry) || (event.key !== "ArrowUp" && event.key !== "ArrowDown")) return;
    event.preventDefault();
    draft.step(event.key === "ArrowUp" ? 1 : -1);
  };
  return (
    <TextInput
      className={classes.typed ?? ""}
      label={t("page.entry.new_value")}
      description={draft.hint === "" ? undefined : draft.hint}
      rightSection={unit !== "" && !isHex(entry) ? <Text size="sm">{unit}</Text> : undefined}
      rightSectionWidth={56}
      value={draft.text}
      error={draft.error}
      onChange={(event) => draft.setText(event.currentTarget.value)}
      onKeyDown={onKeyDown}
      data-autofocus
      data-testid="new-value"
    />
  );
}

const OTHER = "other";

function EnumEditor(props: Props) {
  const { t, doc } = useDevice();
  const { entry, draft } = props;
  const table = doc.enumerations[entry.enumeration ?? ""];
  const named = table?.values.find((one) => one.value === draft.raw);
  const [other, setOther] = useState(table?.exclusive === false && draft.text !== "" && !named);
  const options = (table?.values ?? []).map((one) => ({
    value: String(one.value),
    label: `${t(one.text_key)} (${isHex(entry) ? hexadecimal(entry, one.value) : one.value})`,
  }));
  if (table?.exclusive === false) options.push({ value: OTHER, label: t("page.entry.other_number") });
  return (
    <Stack gap="sm">
      <Select
        label={t("page.entry.new_value")}
        data={options}
        value={other ? OTHER : named ? String(named.value) : null}
        error={other ? null : draft.error}
        searchable
        nothingFoundMessage={t("page.entry.no_such_name")}
        allowDeselect={false}
        maxDropdownHeight={320}
        comboboxProps={{ withinPortal: true }}
        onChange={(choice) => {
          setOther(choice === OTHER);
          if (choice !== null && choice !== OTHER) draft.setText(`raw:${choice}`);
        }}
        data-autofocus
        data-testid="new-value"
      />
      {other && <TextEditor {...props} />}
    </Stack>
  );
}

/** With more bits than this a filter of their own helps. */
const MANY_BITS = 12;

/** A mask by its named bits; the hexadecimal number stays in step below. Bits without a name keep their value. */
function BitsEditor(props: Props & { table: readonly BitDoc[] }) {
  const { t } = useDevice();
  const { entry, draft, table } = props;
  const [wanted, setWanted] = useState("");
  const raw = typeof draft.raw === "number" ? draft.raw : null;
  // Bits without a name must keep their value: with nothing known there is nothing to start from.
  const set = (bit: BitDoc, value: number) => {
    if (raw !== null) draft.setText(hexadecimal(entry, withField(entry, raw, bit, value)));
  };
  const shown = table.filter((bit) => labelOf(bit, t).toLowerCase().includes(wanted.toLowerCase()));
  const count = raw === null ? 0 : table.filter((bit) => fieldOf(entry, raw, bit) !== 0).length;
  return (
    <Stack gap="xs">
      {table.length > MANY_BITS && (
        <TextInput
          aria-label={t("page.entry.bit_filter")}
          placeholder={t("page.entry.bit_filter")}
          value={wanted}
          onChange={(event) => setWanted(event.currentTarget.value)}
        />
      )}
      <fieldset className={classes.bits} disabled={raw === null} data-testid="bits">
        <legend>{t("page.entry.bits_set", { count, total: table.length })}</legend>
        {shown.map((bit) => (
          <BitField key={bit.bit} entry={entry} bit={bit} raw={raw} onSet={(value) => set(bit, value)} />
        ))}
      </fieldset>
      <TextEditor entry={entry} draft={draft} />
    </Stack>
  );
}

type Texts = ReturnType<typeof useDevice>["t"];

/** `3 · X14.4 · Lüfter (3120h)`: number, clamp, name, error code. */
function labelOf(bit: BitDoc, t: Texts): string {
  const range = bit.last === bit.bit ? String(bit.bit) : `${bit.bit}–${bit.last}`;
  const name = [bit.clamp, t(bit.text_key)].filter(Boolean).join(" · ");
  const note = bit.error_code === null ? "" : ` (${errorCode(bit.error_code)})`;
  return t("page.entry.bit", { range, name: `${name}${note}` });
}

interface BitProps {
  entry: EntryDoc;
  bit: BitDoc;
  raw: number | null;
  onSet: (value: number) => void;
}

function BitField({ entry, bit, raw, onSet }: BitProps) {
  const { t, lookup } = useDevice();
  const value = raw === null ? 0 : fieldOf(entry, raw, bit);
  const label = labelOf(bit, t);
  if (bit.last !== bit.bit) {
    return (
      <NumberInput
        label={label}
        value={value}
        min={0}
        max={fieldMax(bit)}
        clampBehavior="strict"
        allowDecimal={false}
        allowNegative={false}
        onChange={(number) => onSet(Number(number) || 0)}
      />
    );
  }
  const ram = lookup(entry.address);
  const changed = typeof ram === "number" && raw !== null && fieldOf(entry, ram, bit) !== value;
  return (
    <Checkbox
      className={classes.bit}
      label={changed ? `${label} ✎` : label}
      checked={value === 1}
      onChange={(event) => onSet(event.currentTarget.checked ? 1 : 0)}
    />
  );
}
