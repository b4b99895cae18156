import type { PdoMapped, PdoSetup } from "../../../api/pdo";
import type { DeviceContext } from "../../../model/shown";
import { useTexts } from "../../../texts/texts";
import { useReading } from "../../../ui/reading";
import { bitsOf, MAX_BITS } from "./edits";
import { objectName } from "./names";
import classes from "./Pdo.module.css";

interface Props {
  title: string;
  setup: PdoSetup;
  context: DeviceContext | null;
  /** Values come by it now. */
  alive: boolean;
}

/** The 64 bits of a frame, and what lies where. */
export function MappingBar({ title, setup, context, alive }: Props) {
  const t = useTexts();
  const bits = bitsOf(setup);
  const whole = Math.max(MAX_BITS, bits);
  return (
    <ol
      className={classes.bits}
      aria-label={t("page.pdo.bar", { pdo: title, bits })}
      data-over={bits > MAX_BITS}
    >
      {setup.mapped.map((one, place) => (
        <Part key={`${place}-${one.object}`} mapped={one} whole={whole} context={context} alive={alive} />
      ))}
      {bits < MAX_BITS && (
        <li className={classes.free} style={{ flexGrow: MAX_BITS - bits }}>
          {setup.mapped.length === 0 ? t("page.pdo.empty") : ""}
        </li>
      )}
    </ol>
  );
}

interface PartProps {
  mapped: PdoMapped;
  whole: number;
  context: DeviceContext | null;
  alive: boolean;
}

function Part({ mapped, whole, context, alive }: PartProps) {
  const t = useTexts();
  const reading = useReading(context, mapped.object, "fast");
  const name = objectName(context, mapped, t);
  const value = reading === null ? "–" : `${reading.text}${reading.unit === "" ? "" : ` ${reading.unit}`}`;
  return (
    <li
      className={classes.part}
      style={{ flexBasis: `${(100 * mapped.bits) / whole}%` }}
      title={`${mapped.object} · ${name} · ${t("page.pdo.bits", { bits: mapped.bits })}`}
    >
      <span className={classes.partName}>{name}</span>
      <span className={classes.partFoot}>
        <span className={classes.address}>{mapped.object}</span>
        <span
          className={classes.value}
          data-stale={!alive || (reading?.stale ?? true)}
          data-testid={`pdo-value-${mapped.object}`}
        >
          {value}
        </span>
      </span>
    </li>
  );
}
