/** How a cell stands to the others of its row: beside the reference, or beside what most hold. */
import type { CellDoc } from "../../../api/compare";

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

type Cells = readonly CellDoc[];

export function marksOf(cells: Cells, against: Against): Mark[] {
  return against === Against.Reference ? besideFirst(cells) : besideMost(cells);
}

function besideFirst(cells: Cells): Mark[] {
  const [first] = cells;
  return cells.map((cell, at) => {
    if (at === 0) return Mark.Reference;
    if (first?.state !== "value" || cell.state !== "value") return Mark.Apart;
    return cell.raw === first.raw ? Mark.Same : Mark.Different;
  });
}

/** Two of three agree: the third is the one to look at. Where no value is the most frequent, all differ. */
function besideMost(cells: Cells): Mark[] {
  const most = mostFrequent(cells);
  return cells.map((cell) => {
    if (cell.state !== "value") return Mark.Apart;
    return most !== null && cell.raw === most.raw ? Mark.Same : Mark.Different;
  });
}

function mostFrequent(cells: Cells): { raw: CellDoc["raw"] } | null {
  const counts = new Map<CellDoc["raw"], number>();
  for (const { state, raw } of cells) if (state === "value") counts.set(raw, (counts.get(raw) ?? 0) + 1);
  const ranked = [...counts].toSorted((a, b) => b[1] - a[1]);
  const [first, second] = ranked;
  if (!first || second?.[1] === first[1]) return null;
  return { raw: first[0] };
}
