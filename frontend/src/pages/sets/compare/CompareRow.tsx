import { Checkbox } from "@mantine/core";
import { IconChevronDown, IconChevronRight } from "@tabler/icons-react";
import { memo, type ReactNode } from "react";
import { categoryName } from "../../../model/saving";
import { useTexts } from "../../../texts/texts";
import { BitCells, FactsCells, ValueCell } from "./Cells";
import type { ColumnContext } from "./compared";
import classes from "./Compare.module.css";
import { FindingText, SeveritySign, useSeverity } from "./FindingText";
import type { CompareLine, RowLine, SectionLine } from "./lines";
import { Against, cellMarks, Mark } from "./marks";
import { ClassChip, RowSign } from "./signs";
import { Standing, standingOf } from "./standing";

export interface RowActions {
  onFold: (section: string, open: boolean) => void;
  onExpand: (address: string, open: boolean) => void;
  onPick: (address: string) => void;
}

interface Props {
  line: CompareLine;
  index: number;
  top: number;
  height: number;
  tracks: string;
  active: boolean;
  columns: readonly ColumnContext[];
  against: Against;
  /** null where it cannot be picked. */
  picked: boolean | null;
  onActive: (index: number) => void;
  actions: RowActions;
}

export const CompareRow = memo(function CompareRow(props: Props) {
  const { line } = props;
  const inTable = (level: number, content: ReactNode, more: object = {}) => (
    <div
      id={`compared-${line.id}`}
      role="row"
      aria-level={level}
      aria-rowindex={props.index + 2}
      className={classes.line}
      data-kind={line.kind}
      data-active={props.active}
      style={{
        transform: `translateY(${props.top}px)`,
        height: props.height,
        gridTemplateColumns: line.kind === "section" || line.kind === "finding" ? "1fr" : props.tracks,
      }}
      onClick={() => props.onActive(props.index)}
      {...more}
    >
      {content}
    </div>
  );
  switch (line.kind) {
    case "section":
      return inTable(1, <Section line={line} onFold={props.actions.onFold} />, {
        "aria-expanded": line.open,
        "data-allowed": line.allowed,
      });
    case "row":
      return inTable(2, <Entry {...props} line={line} />, {
        "aria-expanded": line.expanded,
        "aria-selected": props.picked ?? undefined,
        "data-state": line.compared.row.state,
        "data-testid": `compared-${line.id}`,
      });
    case "finding":
      return inTable(3, <FindingText line={line} columns={props.columns} against={props.against} />);
    case "bit":
      return inTable(
        3,
        <BitCells line={line} against={props.against} pickable={props.tracks.startsWith("40px")} />,
        {
          "data-testid": `bit-${line.id}`,
        },
      );
    case "facts":
      return inTable(
        3,
        <FactsCells line={line} columns={props.columns} pickable={props.tracks.startsWith("40px")} />,
      );
  }
});

function Section({ line, onFold }: { line: SectionLine; onFold: RowActions["onFold"] }) {
  const Chevron = line.open ? IconChevronDown : IconChevronRight;
  return (
    <div role="gridcell">
      <button
        type="button"
        tabIndex={-1}
        onClick={() => onFold(line.id, !line.open)}
        data-testid={`section-${line.id}`}
      >
        <Chevron size={17} aria-hidden />
        {line.title}
        <span className="dim">{line.count}</span>
      </button>
    </div>
  );
}

function Entry({ line, columns, against, picked, actions }: Props & { line: RowLine }) {
  const t = useTexts();
  const { row, title, known } = line.compared;
  const marks = cellMarks(row.cells, against);
  const like = against === Against.Reference ? 0 : marks.indexOf(Mark.Same);
  const reference = row.cells[like]?.raw ?? null;
  const Chevron = line.expanded ? IconChevronDown : IconChevronRight;
  return (
    <>
      {picked !== null && (
        <div role="gridcell" className={classes.pick}>
          <Checkbox
            tabIndex={-1}
            checked={picked}
            aria-label={t("page.compare.pick", { name: title })}
            onChange={() => actions.onPick(line.id)}
            data-testid={`pick-${line.id}`}
          />
        </div>
      )}
      <div role="gridcell">
        <RowSign state={row.state} />
      </div>
      <div role="gridcell" data-column="name">
        <button
          type="button"
          tabIndex={-1}
          className={classes.name}
          title={`${row.address} ${title}`}
          onClick={() => actions.onExpand(line.id, !line.expanded)}
          data-testid={`expand-${line.id}`}
        >
          <Chevron size={15} aria-hidden />
          <span className={classes.words}>
            <span className={classes.own}>{known?.ownName ?? title}</span>
            <small>
              {row.address}
              {known?.objectName != null && ` · ${known.objectName}`}
              {row.save_category !== null && ` · ${categoryName(row.save_category, t)}`}
            </small>
          </span>
        </button>
      </div>
      <div role="gridcell" className={classes.matters}>
        <Weight line={line} against={against} />
      </div>
      {row.cells.map((cell, at) => {
        const column = columns[at];
        return column ? (
          <ValueCell
            key={column.column.spec}
            row={row}
            cell={cell}
            column={column}
            mark={marks[at]}
            reference={reference}
          />
        ) : null;
      })}
    </>
  );
}

/** Whether it matters: what a restore makes of it, and what the rules say. */
function Weight({ line, against }: { line: RowLine; against: Against }) {
  const t = useTexts();
  const { row } = line.compared;
  const count = row.findings.length;
  const severity = useSeverity(row.findings);
  const isNew = row.findings.some(
    (rule) => standingOf(row.found_in[rule] ?? [], row.cells.length, against) === Standing.New,
  );
  return (
    <>
      <ClassChip restore={row.restore} />
      {count > 0 && (
        <span
          className={classes.findings}
          title={row.findings.map((rule) => t(`rule.${rule}.title`)).join("\n")}
        >
          <SeveritySign severity={severity} />
          {t(count === 1 ? "page.compare.finding" : "page.compare.findings", { count })}
          {isNew && <span className={classes.fresh}>{t("page.compare.new")}</span>}
        </span>
      )}
    </>
  );
}
