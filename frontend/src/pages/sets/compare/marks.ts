/** How a cell stands to the others of its row: beside the reference, or beside what most hold. */
import type { CellDoc } from "../../../api/compare";
import type { Raw } from "../../../api/types";

export enum Mark {
  Reference = "reference",
  Same = "same",
  Different = "different",
  /** There is no value here, or none to compare it with. */
  Apart = "apart",
}

/** `Reference`: the first column is what the others are held against. `Majority`: columns are equals, such as blades. */
export enum Against {
  Reference = "reference",
  Majority = "majority",
}

/** null: there is no value. */
type Values = readonly (Raw | null)[];

export const marksOf = (values: Values, against: Against): Mark[] =>
  against === Against.Reference ? besideFirst(values) : besideMost(values);

export const cellMarks = (cells: readonly CellDoc[], against: Against): Mark[] =>
  marksOf(
    cells.map((cell) => (cell.state === "value" ? cell.raw : null)),
    against,
  );

function besideFirst(values: Values): Mark[] {
  const [first = null] = values;
  return values.map((value, at) => {
    if (at === 0) return Mark.Reference;
    if (first === null || value === null) return Mark.Apart;
    return value === first ? Mark.Same : Mark.Different;
  });
}

/** Two of three agree: the third is the one to look at. Where no value is the most frequent, all differ. */
function besideMost(values: Values): Mark[] {
  const most = mostFrequent(values);
  return values.map((value) => {
    if (value === null) return Mark.Apart;
    return value === most ? Mark.Same : Mark.Different;
  });
}

function mostFrequent(values: Values): Raw | null {
  const counts = new Map<Raw, number>();
  for (const value of values) if (value !== null) counts.set(value, (counts.get(value) ?? 0) + 1);
  const [first, second] = [...counts].toSorted((a, b) => b[1] - a[1]);
  return !first || second?.[1] === first[1] ? null : first[0];
}
