/** In which columns a rule is broken, and what that says of the way from the reference to the others. */
import { Against } from "./marks";

export enum Standing {
  /** Not broken in the reference: whoever takes the other column's values brings it about. */
  New = "new",
  /** Broken in the reference and beside it. */
  Standing = "standing",
  /** Broken in the reference alone. */
  Mended = "mended",
  /** Columns are equals, and some break it. */
  Some = "some",
  All = "all",
}

/** `broken`: the columns in which the rule is broken, of `count`. */
export function standingOf(broken: readonly number[], count: number, against: Against): Standing {
  if (against === Against.Majority) return broken.length < count ? Standing.Some : Standing.All;
  if (!broken.includes(0)) return Standing.New;
  return broken.length > 1 ? Standing.Standing : Standing.Mended;
}
