import { IconAlertTriangle, IconCircleX } from "@tabler/icons-react";
import { type KeyboardEvent, useRef, useState } from "react";
import type { BitDoc } from "../../../../api/types";
import { lineOfFinding } from "../../../../model/ruleFindings";
import type { DeviceContext } from "../../../../model/shown";
import { useTexts } from "../../../../texts/texts";
import { useReading } from "../../../../ui/reading";
import { Findings, findingsOf } from "../common/Findings";
import { type Parameter, setRaw, type Setup } from "../common/parameter";
import classes from "./Masks.module.css";
import {
  conflictOf,
  CONTROLLER_LEVELS,
  CONTROLLER_MASK,
  groupsOf,
  hasBit,
  outputsOf,
  READ_BACK,
  stepIn,
  toggled,
} from "./matrix";

const TABLE = "output_mask";

interface Props {
  unit: DeviceContext;
  setup: Setup;
  columns: readonly string[];
}

const keyOf = (address: string): string => address.replace(":", "_");

/** Outputs by functions: a cell gives the output of its row to the function of its column. Arrow keys go from cell to cell. */
export function OutputMatrix({ unit, setup, columns }: Props) {
  const t = useTexts();
  const grid = useRef<HTMLTableElement>(null);
  const [at, setAt] = useState<[number, number]>([0, 0]);
  const rows = outputsOf(unit.doc.bit_tables[TABLE] ?? []);
  const parameters = columns.map((address) => setup.of(unit, address));
  const onKeyDown = (event: KeyboardEvent) => {
    const next = stepIn(event.key, at[0], at[1], rows.length, columns.length);
    if (next === null || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    setAt(next);
    grid.current?.querySelector<HTMLElement>(`[data-cell="${next.join("-")}"]`)?.focus();
  };
  return (
    <section className={classes.panel} aria-labelledby="setup-outputs">
      <h2 id="setup-outputs">{t("page.setup.masks.outputs")}</h2>
      <p className="dim">{t("page.setup.masks.outputs_intro")}</p>
      <div className={classes.scroll}>
        <table
          ref={grid}
          role="grid"
          className={classes.matrix}
          aria-labelledby="setup-outputs"
          onKeyDown={onKeyDown}
          data-testid="output-matrix"
        >
          <Heads columns={columns} />
          <tbody>
            {rows.map((bit, row) => (
              <tr key={bit.bit}>
                <th scope="row">
                  {bit.clamp} <small>{t(`page.setup.masks.rating.${bit.name}`)}</small>
                </th>
                {parameters.map((parameter, column) => (
                  <Cell
                    key={columns[column]}
                    parameter={parameter}
                    address={columns[column] ?? ""}
                    bit={bit}
                    place={[row, column]}
                    current={at[0] === row && at[1] === column}
                    onFocus={() => setAt([row, column])}
                    given={!isLevel(columns[column]) || isGiven(setup.of(unit, CONTROLLER_MASK), bit)}
                  />
                ))}
                <Level unit={unit} bit={bit} />
              </tr>
            ))}
          </tbody>
        </table>
      </div>
      <Findings findings={findingsOf(parameters)} />
    </section>
  );
}

const isLevel = (address: string | undefined): boolean => address === CONTROLLER_LEVELS;
const isGiven = (mask: Parameter | null, bit: BitDoc): boolean =>
  mask?.raw != null && hasBit(mask.raw, bit.bit);

function Heads({ columns }: { columns: readonly string[] }) {
  const t = useTexts();
  return (
    <thead>
      <tr>
        <th rowSpan={2} scope="col">
          {t("page.setup.masks.output")}
        </th>
        {groupsOf(columns).map(({ index, count }) => (
          <th key={index} colSpan={count} scope="colgroup" className={classes.group}>
            {t(`page.setup.masks.group.${index}`)} <small>{index}h</small>
          </th>
        ))}
        <th rowSpan={2} scope="col">
          {t("page.setup.masks.now")}
        </th>
      </tr>
      <tr>
        {columns.map((address) => (
          <th key={address} scope="col" title={address}>
            {t(`page.setup.masks.function.${keyOf(address)}`)}
          </th>
        ))}
      </tr>
    </thead>
  );
}

interface CellProps {
  parameter: Parameter | null;
  address: string;
  bit: BitDoc;
  place: [number, number];
  current: boolean;
  /** A level of the controller counts only where its mask gives it the output. */
  given: boolean;
  onFocus: () => void;
}

function Cell({ parameter, address, bit, place, current, given, onFocus }: CellProps) {
  const t = useTexts();
  const index = address.split(":")[0] ?? "";
  const name = t("page.setup.masks.cell", {
    clamp: bit.clamp ?? "",
    function: `${t(`page.setup.masks.group.${index}`)}, ${t(`page.setup.masks.function.${keyOf(address)}`)}`,
  });
  if (parameter?.raw == null)
    return (
      <td role="gridcell">
        <span className="dim">–</span>
      </td>
    );
  const { raw, ram, lock, findings } = parameter;
  const set = hasBit(raw, bit.bit);
  const pending = ram !== null && hasBit(ram, bit.bit) !== set;
  const conflict = set ? conflictOf(findings, bit.clamp ?? "") : null;
  const Icon = conflict?.severity === "error" ? IconCircleX : IconAlertTriangle;
  const why = conflict === null ? "" : `. ${t("page.setup.masks.conflict")}: ${lineOfFinding(conflict, t)}`;
  return (
    <td role="gridcell" data-conflict={conflict?.severity}>
      <button
        type="button"
        role="checkbox"
        aria-checked={set}
        aria-disabled={lock !== null}
        aria-label={`${name}${pending ? `, ${t("page.setup.common.is_pending")}` : ""}${why}`}
        title={lock === null ? `${name}${why}` : t(`page.locked.${lock}`)}
        tabIndex={current ? 0 : -1}
        data-cell={place.join("-")}
        data-pending={pending}
        data-faint={!given}
        onFocus={onFocus}
        onClick={() => {
          if (lock === null) setRaw(parameter, toggled(raw, bit.bit));
        }}
        data-testid={`cell-${address}-${bit.bit}`}
      >
        <span aria-hidden>{set ? "●" : "·"}</span>
        {pending && <i aria-hidden>✎</i>}
        {conflict !== null && (
          <em aria-hidden>
            <Icon size={13} /> {t("page.setup.masks.conflict_mark")}
          </em>
        )}
      </button>
    </td>
  );
}

/** What the unit says that the output gives now; it is no measurement of the clamp. */
function Level({ unit, bit }: { unit: DeviceContext; bit: BitDoc }) {
  const t = useTexts();
  const reading = useReading(unit, READ_BACK, "slow");
  if (typeof reading?.raw !== "number") return <td className="dim">–</td>;
  const on = hasBit(reading.raw, bit.bit);
  return (
    <td className={classes.level} data-on={on} data-stale={reading.stale} data-testid={`level-${bit.bit}`}>
      {t(on ? "page.setup.masks.on" : "page.setup.masks.off")}
    </td>
  );
}
