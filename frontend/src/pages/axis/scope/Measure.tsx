import { NumberInput } from "@mantine/core";
import { useTexts } from "../../../texts/texts";
import { typedNumber } from "../../../ui/typedNumber";
import { localise } from "../../../model/values";
import { spanAt } from "../../../model/tracks";
import { Swatch } from "./Swatch";
import classes from "./Scope.module.css";
import { numberText, secondsText, spanText, type Trace, valueAt } from "./traces";
import type { Pair } from "./view";

interface Props {
  traces: readonly Trace[];
  cursors: Pair | null;
  hoverS: number | null;
  onCursors: (cursors: Pair) => void;
}

/** What is drawn, with its value at the pointer, at both cursors, and between them. */
export function Measure({ traces, cursors, hoverS, onCursors }: Props) {
  const t = useTexts();
  return (
    <section aria-label={t("page.scope.measure")} className={classes.measure}>
      {cursors && <CursorTimes cursors={cursors} onCursors={onCursors} />}
      <div className={classes.scroll} tabIndex={0} role="group" aria-label={t("page.scope.legend")}>
        <table className={`${classes.values} bench`} data-testid="measure">
          <thead>
            <tr>
              <th scope="col">{t("page.scope.column_signal")}</th>
              <th scope="col" className={classes.number}>
                {t("page.scope.value_here")}
              </th>
              {cursors && (
                <>
                  <th scope="col" className={classes.number}>
                    A
                  </th>
                  <th scope="col" className={classes.number}>
                    B
                  </th>
                  <th scope="col" className={classes.number}>
                    {t("page.scope.column_delta")}
                  </th>
                </>
              )}
            </tr>
          </thead>
          <tbody>
            {traces.map((trace) => (
              <Row key={`${trace.name} ${trace.reference ?? ""}`} {...{ trace, cursors, hoverS }} />
            ))}
          </tbody>
        </table>
      </div>
    </section>
  );
}

function Row({ trace, cursors, hoverS }: { trace: Trace; cursors: Pair | null; hoverS: number | null }) {
  const t = useTexts();
  const text = (atS: number) => spanText(spanAt(trace.track, atS), trace, t);
  const [a, b] = cursors === null ? [null, null] : [valueAt(trace, cursors[0]), valueAt(trace, cursors[1])];
  const unit = trace.unit === "" ? "" : ` ${trace.unit}`;
  return (
    <tr data-testid={trace.reference === null ? `trace-${trace.name}` : `reference-${trace.name}`}>
      <th scope="row">
        <Swatch colour={trace.colour} dash={trace.dash} /> {trace.label}
        {trace.reference !== null && (
          <span className="dim"> {t("page.scope.reference_note", { name: trace.reference })}</span>
        )}
      </th>
      <td className={classes.number}>{hoverS === null ? "" : `${text(hoverS)}${unit}`}</td>
      {cursors && (
        <>
          <td className={classes.number} data-testid="at-a">{`${text(cursors[0])}${unit}`}</td>
          <td className={classes.number} data-testid="at-b">{`${text(cursors[1])}${unit}`}</td>
          <td className={classes.number} data-testid="delta">
            {a === null || b === null ? "–" : `${numberText(b - a, trace.decimals, t)}${unit}`}
          </td>
        </>
      )}
    </tr>
  );
}

function CursorTimes({ cursors, onCursors }: { cursors: Pair; onCursors: (cursors: Pair) => void }) {
  const t = useTexts();
  const deltaS = cursors[1] - cursors[0];
  const field = (name: "A" | "B", value: number, take: (atS: number) => void) => (
    <NumberInput
      label={t("page.scope.at", { name })}
      value={Number(value.toFixed(6))}
      onChange={(typed) => typedNumber(typed, take)}
      decimalSeparator={t.language === "de" ? "," : "."}
      step={0.01}
      hideControls
      w={120}
      data-testid={`cursor-${name.toLowerCase()}`}
    />
  );
  return (
    <div className={`${classes.cursorTimes} bench`}>
      {field("A", cursors[0], (atS) => onCursors([atS, cursors[1]]))}
      {field("B", cursors[1], (atS) => onCursors([cursors[0], atS]))}
      <span data-testid="delta-t">
        {t("page.scope.delta_t")} <strong>{secondsText(deltaS, t, 6)} s</strong>
      </span>
      <span data-testid="one-over-delta-t">
        {t("page.scope.frequency")}{" "}
        <strong>
          {deltaS === 0 ? "–" : `${localise((1 / Math.abs(deltaS)).toPrecision(4), t.language)} Hz`}
        </strong>
      </span>
    </div>
  );
}
