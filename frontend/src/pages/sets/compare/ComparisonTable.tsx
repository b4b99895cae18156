import { useVirtualizer } from "@tanstack/react-virtual";
import { memo, type ReactNode, type RefObject, useCallback, useImperativeHandle, useRef } from "react";
import { useTexts } from "../../../texts/texts";
import type { Compared } from "./compared";
import classes from "./Compare.module.css";
import { CompareRow, type RowActions } from "./CompareRow";
import type { CompareLine } from "./lines";
import type { Against } from "./marks";
import { useCompareKeys } from "./tableKeys";

const SECTION_PX = 36;
const ROW_PX = 40;
const DETAIL_PX = 30;
const OVERSCAN = 6;
/** The tallest head: place, state, when, and what it comes to. */
const HEAD_PX = 84;

const heightOf = (line: CompareLine | undefined): number => {
  if (line?.kind === "section") return SECTION_PX;
  return line?.kind === "row" ? ROW_PX : DETAIL_PX;
};

/** What others may ask of the table. */
export interface CompareTableHandle {
  focus: () => void;
}

interface Props {
  label: string;
  compared: Compared;
  lines: readonly CompareLine[];
  against: Against;
  actions: RowActions;
  /** Addresses that are picked to be restored; null where nothing can be. */
  picked: ReadonlySet<string> | null;
  head: ReactNode;
  empty: ReactNode;
  handle?: RefObject<CompareTableHandle | null>;
}

/** Tracks of the CSS grid: sign, name, what it matters, and one a column. */
function tracksOf(columns: number, pickable: boolean): string {
  return `${pickable ? "40px " : ""}34px minmax(212px, 1.5fr) 118px repeat(${columns}, minmax(132px, 1fr))`;
}

const leastWidth = (columns: number): number => 410 + columns * 132;

/** The rows side by side; only what is seen is in the document. */
export const ComparisonTable = memo(function ComparisonTable(props: Props) {
  const { compared, lines, actions, picked } = props;
  const t = useTexts();
  const scroller = useRef<HTMLDivElement>(null);
  const virtual = useVirtualizer({
    count: lines.length,
    getScrollElement: () => scroller.current,
    estimateSize: (at) => heightOf(lines[at]),
    getItemKey: (at) => lines[at]?.id ?? at,
    overscan: OVERSCAN,
    scrollPaddingStart: HEAD_PX,
    useFlushSync: false,
  });
  const scrollTo = useCallback((at: number) => virtual.scrollToIndex(at), [virtual]);
  const keys = useCompareKeys({ lines, scroller, scrollTo, actions, pickable: picked !== null });
  useImperativeHandle(props.handle, () => ({ focus: () => scroller.current?.focus() }));
  const tracks = tracksOf(compared.columns.length, picked !== null);
  const active = lines[keys.at];
  const wide = { minWidth: leastWidth(compared.columns.length) };
  return (
    <div
      ref={scroller}
      className={`${classes.grid} bench`}
      role="treegrid"
      tabIndex={0}
      aria-label={props.label}
      aria-rowcount={lines.length + 1}
      aria-multiselectable={picked === null ? undefined : true}
      aria-activedescendant={active ? `compared-${active.id}` : undefined}
      data-testid="comparison"
      onKeyDown={keys.onKeyDown}
    >
      <div role="rowgroup" className={classes.top} style={wide}>
        <div role="row" aria-rowindex={1} className={classes.head} style={{ gridTemplateColumns: tracks }}>
          {picked !== null && (
            <div role="columnheader">
              <span className="visually-hidden">{t("page.compare.head.pick")}</span>
            </div>
          )}
          <div role="columnheader">
            <span className="visually-hidden">{t("page.compare.head.state")}</span>
          </div>
          <div role="columnheader">{t("page.compare.head.parameter")}</div>
          <div role="columnheader">{t("page.compare.head.matters")}</div>
          {props.head}
        </div>
      </div>
      <div role="rowgroup" className={classes.lines} style={{ ...wide, height: virtual.getTotalSize() }}>
        {virtual.getVirtualItems().map((item) => {
          const line = lines[item.index];
          if (!line) return null;
          return (
            <CompareRow
              key={item.key}
              line={line}
              index={item.index}
              top={item.start}
              height={item.size}
              tracks={tracks}
              active={item.index === keys.at}
              columns={compared.columns}
              against={props.against}
              picked={picked === null || line.kind !== "row" ? null : picked.has(line.id)}
              onActive={keys.go}
              actions={actions}
            />
          );
        })}
      </div>
      {lines.length === 0 && <div className={classes.empty}>{props.empty}</div>}
    </div>
  );
});
