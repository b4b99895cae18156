import { Checkbox, NumberInput, Select, Stack, Text, TextInput } from "@mantine/core";
import { useState } from "react";
import type { BitDoc, EntryDoc } from "../../api/types";
import { fieldMax, fieldOf, withField } from "../../model/bits";
import { limitText } from "../../model/shown";
import { hexadecimal, isHex, parse, quantityOf } from "../../model/values";
import { errorCode } from "../../ui/format";
import { useDevice } from "./context";
import classes from "./Parameters.module.css";

interface Props {
  entry: EntryDoc;
  /** The one draft: whatever editor is used, it is this text that is parsed, checked and sent. */
  typed: string;
  onTyped: (text: string) => void;
  error: string | null;
}

export function ValueEditor(props: Props) {
  const { doc } = useDevice();
  const { entry } = props;
  if (entry.enumeration !== null && doc.enumerations[entry.enumeration]) return <EnumEditor {...props} />;
  const table = entry.bits === null ? undefined : doc.bit_tables[entry.bits];
  if (table) return <BitsEditor {...props} table={table} />;
  return <TextEditor {...props} />;
}

function TextEditor({ entry, typed, onTyped, error }: Props) {
  const context = useDevice();
  const { t, lookup } = context;
  const { unit } = quantityOf(entry, lookup);
  const limits = limitText(entry, context, true);
  return (
    <TextInput
      label={t("page.entry.new_value")}
      description={
        limits === "" ? undefined : t("page.entry.allowed", { limits, unit: isHex(entry) ? "" : unit })
      }
      rightSection={unit !== "" && !isHex(entry) ? <Text size="sm">{unit}</Text> : undefined}
      rightSectionWidth={56}
      value={typed}
      error={error}
      onChange={(event) => onTyped(event.currentTarget.value)}
      data-autofocus
      data-testid="new-value"
    />
  );
}

const OTHER = "other";

function EnumEditor(props: Props) {
  const { t, doc, lookup } = useDevice();
  const { entry, typed, onTyped, error } = props;
  const table = doc.enumerations[entry.enumeration ?? ""];
  const parsed = parse(doc, entry, typed, lookup);
  const named = table?.values.find((one) => parsed.ok && one.value === parsed.raw);
  const [other, setOther] = useState(table?.exclusive === false && typed !== "" && !named);
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
        error={other ? null : error}
        allowDeselect={false}
        maxDropdownHeight={320}
        comboboxProps={{ withinPortal: true }}
        onChange={(choice) => {
          setOther(choice === OTHER);
          if (choice !== null && choice !== OTHER) onTyped(`raw:${choice}`);
        }}
        data-autofocus
        data-testid="new-value"
      />
      {other && <TextEditor {...props} />}
    </Stack>
  );
}

/** A mask by its named bits; the hexadecimal number stays in step below. Bits without a name keep their value. */
function BitsEditor(props: Props & { table: readonly BitDoc[] }) {
  const { t, doc, lookup } = useDevice();
  const { entry, typed, onTyped, table } = props;
  const parsed = parse(doc, entry, typed, lookup);
  const raw = parsed.ok && typeof parsed.raw === "number" ? parsed.raw : null;
  // Bits without a name must keep their value: with nothing known there is nothing to start from.
  const set = (bit: BitDoc, value: number) => {
    if (raw !== null) onTyped(hexadecimal(entry, withField(entry, raw, bit, value)));
  };
  return (
    <Stack gap="sm">
      <fieldset className={classes.bits} disabled={raw === null}>
        <legend>{t("page.entry.bits")}</legend>
        {table.map((bit) => (
          <BitField key={bit.bit} entry={entry} bit={bit} raw={raw} onSet={(value) => set(bit, value)} />
        ))}
      </fieldset>
      <TextEditor {...props} />
    </Stack>
  );
}

interface BitProps {
  entry: EntryDoc;
  bit: BitDoc;
  raw: number | null;
  onSet: (value: number) => void;
}

function BitField({ entry, bit, raw, onSet }: BitProps) {
  const { t } = useDevice();
  const value = raw === null ? 0 : fieldOf(entry, raw, bit);
  const range = bit.last === bit.bit ? String(bit.bit) : `${bit.bit}–${bit.last}`;
  const name = [bit.clamp, t(bit.text_key)].filter(Boolean).join(" · ");
  const note = bit.error_code === null ? "" : ` (${errorCode(bit.error_code)})`;
  const label = t("page.entry.bit", { range, name: `${name}${note}` });
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
  return (
    <Checkbox
      className={classes.bit}
      label={label}
      checked={value === 1}
      onChange={(event) => onSet(event.currentTarget.checked ? 1 : 0)}
    />
  );
}
