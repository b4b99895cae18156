/** Filter and order of a table's rows. */

export type Sortable = number | string | null;

interface Column<Row> {
  id: string;
  text: (row: Row) => string;
  by?: (row: Row) => Sortable;
}

/** The rows in which every word of the filter is found; `order` names a column, with a minus sign where descending. */
export function arranged<Row>(
  rows: readonly Row[],
  columns: readonly Column<Row>[],
  filter: string,
  order: string | undefined,
): readonly Row[] {
  const words = filter.toLowerCase().split(/\s+/).filter(Boolean);
  const found =
    words.length === 0
      ? rows
      : rows.filter((row) => {
          const hay = columns.map((column) => column.text(row).toLowerCase()).join("\n");
          return words.every((word) => hay.includes(word));
        });
  const column = columns.find((one) => one.id === order?.replace(/^-/, ""));
  if (!column) return found;
  const sign = order?.startsWith("-") ? -1 : 1;
  const key = column.by ?? column.text;
  return found.toSorted((a, b) => sign * compared(key(a), key(b)));
}

/** What is not known comes first. */
function compared(a: Sortable, b: Sortable): number {
  if (a === null || b === null) return Number(a !== null) - Number(b !== null);
  if (typeof a === "number" && typeof b === "number") return a - b;
  return String(a).localeCompare(String(b), undefined, { numeric: true });
}
