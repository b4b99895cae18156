import { CloseButton } from "@mantine/core";
import { useMemo } from "react";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { ColumnPicker } from "./ColumnPicker";
import { Comparison } from "./Comparison";
import classes from "./Compare.module.css";
import { Against } from "./marks";
import { columnsIn, columnsText } from "./specs";
import { Start } from "./Start";
import { useSpecTitle } from "./titles";
import { Verdict } from "./Verdict";

/** Any two or more states of devices side by side: what differs, and whether it matters. */
export function CompareTab() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const columns = useMemo(() => columnsIn(search.columns), [search.columns]);
  const onColumns = (next: string[]) => update({ columns: columnsText(next), select: undefined });
  return (
    <Comparison
      label={t("page.sets.tab.compare")}
      columns={columns}
      against={Against.Reference}
      onColumns={onColumns}
      chooser={(kind) => (
        <>
          <ColumnPicker columns={columns} kind={kind} onColumns={onColumns} />
          {kind === null && <Chosen columns={columns} onColumns={onColumns} />}
        </>
      )}
      verdict={({ doc }) => <Verdict summary={doc.summary} />}
      instead={columns.length < 2 && <Start columns={columns} onColumns={onColumns} />}
    />
  );
}

interface ChosenProps {
  columns: readonly string[];
  onColumns: (columns: string[]) => void;
}

/** What is chosen, while it cannot be shown as a table. */
function Chosen({ columns, onColumns }: ChosenProps) {
  const t = useTexts();
  const titleOf = useSpecTitle();
  if (columns.length === 0) return null;
  return (
    <ul className={classes.chosen} aria-label={t("page.compare.chosen")}>
      {columns.map((column) => (
        <li key={column}>
          {titleOf(column)}
          <CloseButton
            aria-label={t("page.compare.take_out", { column: titleOf(column) })}
            onClick={() => onColumns(columns.filter((one) => one !== column))}
            data-testid={`take-out-${column}`}
          />
        </li>
      ))}
    </ul>
  );
}
