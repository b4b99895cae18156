import { memo } from "react";
import type { BitDoc } from "../../api/types";
import { fieldMax, fieldOf } from "../../model/bits";
import type { DeviceContext } from "../../model/shown";
import { inForce } from "../../model/values";
import { useTexts } from "../../texts/texts";
import { ReadingText } from "../../ui/ReadingText";
import { entriesOf, type Pace, useReading } from "../../ui/reading";
import classes from "./Axis.module.css";

interface Props {
  title: string;
  context: DeviceContext | null;
  address: string;
  pace: Pace;
}

/** A word of bits by name and clamp: a full mark is set, an empty one is not, a dash is not known. */
export function BitPanel({ title, context, address, pace }: Props) {
  const reading = useReading(context, address, pace);
  const described = context ? entriesOf(context.doc).get(address) : undefined;
  const entry = context && described ? inForce(described, context.lookup) : undefined;
  // A device that has no such object has no such card.
  if (context && !entry) return null;
  const table = entry?.bits ? (context?.doc.bit_tables[entry.bits] ?? []) : [];
  return (
    <section className={classes.panel} aria-label={title} data-testid={`bits-${address}`}>
      <h2>
        {title}
        <ReadingText context={context} address={address} pace={pace} instead={() => hexOf(reading)} />
      </h2>
      <ul className={classes.bits} data-stale={reading?.stale ?? true}>
        {entry &&
          table.map((bit) => (
            <Bit
              key={bit.name}
              bit={bit}
              value={typeof reading?.raw === "number" ? fieldOf(entry, reading.raw, bit) : null}
            />
          ))}
      </ul>
    </section>
  );
}

function hexOf(reading: ReturnType<typeof useReading>): string | null {
  return reading?.text ?? null;
}

const Bit = memo(function Bit({ bit, value }: { bit: BitDoc; value: number | null }) {
  const t = useTexts();
  const field = fieldMax(bit) > 1;
  const state = value === null ? "unknown" : value === 0 ? "clear" : "set";
  const mark = value === null ? "–" : field ? String(value) : value === 0 ? "○" : "●";
  return (
    <li data-state={state} data-testid={`bit-${bit.name}`}>
      <span className={classes.mark} aria-hidden>
        {mark}
      </span>
      <span>{t(bit.text_key)}</span>
      {!field && <span className="visually-hidden">{t(`page.axis.bit_${state}`)}</span>}
      <span className={classes.clamp}>{bit.clamp ?? bit.bit}</span>
    </li>
  );
});
