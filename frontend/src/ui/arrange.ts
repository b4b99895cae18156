/** Filter, order and choice of columns of a table, by TanStack Table; its state stands in the URL. */
import {
  type ColumnDef,
  columnFilteringFeature,
  columnVisibilityFeature,
  type ColumnVisibilityState,
  createFilteredRowModel,
  createSortedRowModel,
  globalFilteringFeature,
  type ReactTable,
  rowSortingFeature,
  type SortingState,
  tableFeatures,
  useTable,
} from "@tanstack/react-table";
import { type ReactNode, useMemo } from "react";

export type Sortable = number | string | null;

export interface TableColumn<Row> {
  id: string;
  title: string;
  /** Track of the CSS grid. */
  width: string;
  /** What is searched, copied and exported. */
  text: (row: Row) => string;
  cell?: (row: Row) => ReactNode;
  /** What it is sorted by, where that is not the text. */
  by?: (row: Row) => Sortable;
  /** A column that is always shown. */
  fixed?: boolean;
  numeric?: boolean;
}

/** How a table is looked at: what is typed, the order (column, minus sign where descending), the hidden columns. */
export interface TableView {
  find: string;
  order: string | undefined;
  less: string | undefined;
}

interface Line<Row> {
  row: Row;
  /** What is cached of a row holds for these columns: other texts make other lines. */
  columns: readonly TableColumn<Row>[];
}

interface Options<Row> {
  rows: readonly Row[];
  columns: readonly TableColumn<Row>[];
  idOf: (row: Row) => string;
  view: TableView;
  onView: (change: Partial<Pick<TableView, "order" | "less">>) => void;
  /** Columns that are hidden until somebody chooses. */
  hiddenFirst: readonly string[];
}

const features = tableFeatures({
  columnFilteringFeature,
  columnVisibilityFeature,
  globalFilteringFeature,
  rowSortingFeature,
  filteredRowModel: createFilteredRowModel(),
  sortedRowModel: createSortedRowModel(),
});
type Features = typeof features;

/** A column that is never shown: the texts of all others, which the filter looks at. */
const SEARCHED = "searched";
/** Nothing is hidden, not even what is hidden at first. */
const NONE = "none";

/** The table of these rows: TanStack's, with the URL's view as its state. */
export function useArranged<Row>({
  rows,
  columns,
  idOf,
  view,
  onView,
  hiddenFirst,
}: Options<Row>): ArrangedTable<Row> {
  const { find, order, less } = view;
  const data = useMemo(() => rows.map((row): Line<Row> => ({ row, columns })), [rows, columns]);
  const definitions = useMemo(() => definitionsOf(columns), [columns]);
  const sorting = useMemo(() => sortingOf(order, columns), [order, columns]);
  const columnVisibility = useMemo(
    () => visibilityOf(less?.split(",") ?? hiddenFirst, columns),
    [less, hiddenFirst, columns],
  );
  return useTable<Features, Line<Row>>({
    features,
    columns: definitions,
    data,
    getRowId: (line) => idOf(line.row),
    enableMultiSort: false,
    globalFilterFn: EVERY_WORD,
    getColumnCanGlobalFilter: (column) => column.id === SEARCHED,
    state: { sorting, columnVisibility, globalFilter: find },
    onSortingChange: (change) =>
      onView({ order: orderOf(typeof change === "function" ? change(sorting) : change) }),
    onColumnVisibilityChange: (change) =>
      onView({ less: lessOf(typeof change === "function" ? change(columnVisibility) : change) }),
  });
}

function definitionsOf<Row>(columns: readonly TableColumn<Row>[]): ColumnDef<Features, Line<Row>>[] {
  return [
    {
      id: SEARCHED,
      accessorFn: (line) => line.columns.map((column) => column.text(line.row).toLowerCase()).join("\n"),
      enableSorting: false,
      enableHiding: false,
    },
    ...columns.map((column): ColumnDef<Features, Line<Row>> => ({
      id: column.id,
      accessorFn: (line) => (column.by ?? column.text)(line.row),
      enableSorting: column.title !== "",
      enableHiding: column.fixed !== true,
      sortDescFirst: false,
      sortFn: (a, b) => compared(a.getValue<Sortable>(column.id), b.getValue<Sortable>(column.id)),
    })),
  ];
}

/** Every word is found somewhere in the row. */
const EVERY_WORD = Object.assign(
  (row: { getValue: (id: string) => unknown }, id: string, words: readonly string[]) =>
    words.every((word) => String(row.getValue(id)).includes(word)),
  { resolveFilterValue: (typed: string) => typed.toLowerCase().split(/\s+/).filter(Boolean) },
);

const collator = new Intl.Collator(undefined, { numeric: true });

/** What is not known comes first. */
function compared(a: Sortable, b: Sortable): number {
  if (a === null || b === null) return Number(a !== null) - Number(b !== null);
  if (typeof a === "number" && typeof b === "number") return a - b;
  return collator.compare(String(a), String(b));
}

function sortingOf(order: string | undefined, columns: readonly { id: string }[]): SortingState {
  const id = order?.replace(/^-/, "");
  if (id === undefined || !columns.some((column) => column.id === id)) return [];
  return [{ id, desc: order?.startsWith("-") === true }];
}

const orderOf = ([first]: SortingState): string | undefined => first && `${first.desc ? "-" : ""}${first.id}`;

function visibilityOf(
  hidden: readonly string[],
  columns: readonly { id: string; fixed?: boolean }[],
): ColumnVisibilityState {
  const off = columns.filter((column) => column.fixed !== true && hidden.includes(column.id));
  return { [SEARCHED]: false, ...Object.fromEntries(off.map((column) => [column.id, false])) };
}

function lessOf(visibility: ColumnVisibilityState): string {
  const hidden = Object.keys(visibility).filter((id) => id !== SEARCHED && visibility[id] === false);
  return hidden.length === 0 ? NONE : hidden.join();
}

/** Least width of a table in px: the sum of the least widths of its tracks. */
export function leastWidth(columns: readonly { width: string }[], gapPx: number): number {
  const px = (width: string) => Number(/(\d+)px/.exec(width)?.[1] ?? 0);
  return columns.reduce((sum, column) => sum + px(column.width) + gapPx, gapPx);
}

/** The rows in an order that was held; what came since stands at the end. */
export function inHeldOrder<Row>(
  rows: readonly Row[],
  idOf: (row: Row) => string,
  held: readonly string[],
): readonly Row[] {
  const ranks = new Map(held.map((id, rank) => [id, rank]));
  const rankOf = (row: Row) => ranks.get(idOf(row)) ?? held.length;
  return rows.toSorted((a, b) => rankOf(a) - rankOf(b));
}

export type ArrangedTable<Row> = ReactTable<Features, Line<Row>>;
