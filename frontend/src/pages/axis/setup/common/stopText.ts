import type { Translate } from "../../../../texts/texts";
import type { Edge } from "./bounds";
import { type Parameter, textOf } from "./parameter";

/** Why a mark goes no further. */
export function stopText(parameter: Parameter, by: Edge | null, t: Translate): string | null {
  if (by === null) return null;
  const last = textOf(parameter, by.raw);
  return by.other === null
    ? t("page.setup.common.stops_limit", { last })
    : t("page.setup.common.stops", { last, other: by.other });
}
