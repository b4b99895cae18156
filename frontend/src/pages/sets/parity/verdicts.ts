/** Which of the blades is the odd one. */
import type { ColumnDoc, RowDoc } from "../../../api/compare";
import { Against, cellMarks, Mark } from "../compare/marks";

export interface BladeVerdict {
  column: ColumnDoc;
  /** Parameters in which this blade alone differs from what the others agree on. */
  alone: number;
  /** Parameters in which no two agree. */
  discord: number;
}

/** What is bound to one unit is allowed to differ and does not count. */
export function verdictsOf(columns: readonly ColumnDoc[], rows: readonly RowDoc[]): BladeVerdict[] {
  const verdicts = columns.map((column): BladeVerdict => ({ column, alone: 0, discord: 0 }));
  for (const row of rows) {
    if (row.state !== "different") continue;
    const marks = cellMarks(row.cells, Against.Majority);
    const agreed = marks.includes(Mark.Same);
    verdicts.forEach((verdict, at) => {
      if (marks[at] !== Mark.Different) return;
      if (agreed) verdict.alone += 1;
      else verdict.discord += 1;
    });
  }
  return verdicts;
}
