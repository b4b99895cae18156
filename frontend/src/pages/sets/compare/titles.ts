/** What a column is called: whose it is, and which of the device's states it shows. */
import type { ColumnDoc } from "../../../api/compare";
import { type Translate, useTexts } from "../../../texts/texts";
import { useDeviceName } from "../../../ui/devices";
import { dateAndTime, lastOf } from "../../../ui/format";
import { useCallback } from "react";
import { isLive, parseSpec, Source } from "./specs";

export interface ColumnTitle {
  /** "Blade 2 PMC". */
  place: string;
  /** "now", "as delivered", "set of 2026-03-04 14:03". */
  source: string;
  /** When and by whom, and what else is to know. */
  more: string;
}

/** `WTG-07` of `wtg-07/blade-2/pmc`. */
export const turbineOf = (slug: string): string => (slug.split("/")[0] ?? "").toUpperCase();

const BLADE = /^blade-(\d+)$/;

/** "Blade 2 PMC", of a device of another turbine too. */
export function usePlaceName(): (slug: string) => string {
  const t = useTexts();
  const nameOf = useDeviceName();
  return useCallback(
    (slug) => {
      const named = nameOf(slug);
      const [, station = "", device = ""] = slug.split("/");
      const blade = BLADE.exec(station)?.[1];
      return named !== lastOf(slug) || blade === undefined
        ? named
        : `${t("page.blade", { blade })} ${device.toUpperCase()}`;
    },
    [nameOf, t],
  );
}

export function useColumnTitle(): (column: ColumnDoc, several: boolean) => ColumnTitle {
  const t = useTexts();
  const nameOf = usePlaceName();
  return (column, several) => titleOf(column, several, nameOf, t);
}

function titleOf(
  column: ColumnDoc,
  several: boolean,
  nameOf: (slug: string) => string,
  t: Translate,
): ColumnTitle {
  const slug = column.device;
  const place = several && slug !== "" ? `${turbineOf(slug)} ${nameOf(slug)}` : nameOf(slug);
  const source = t(`page.compare.source.${column.kind}`);
  const when = column.t_ns === null || isLive(column.spec) ? "" : dateAndTime(column.t_ns / 1e6);
  return { place, source, more: [when, column.person].filter(Boolean).join(" · ") };
}

/** The name of a column that is not there (yet): from its text alone. */
export function useSpecTitle(): (column: string) => string {
  const t = useTexts();
  const nameOf = usePlaceName();
  return (column) => {
    const spec = parseSpec(column);
    if (!spec) return column;
    const source = t(`page.compare.source.${spec.source}`);
    return spec.source === Source.Set ? `${source} ${spec.of.slice(0, 8)}` : `${nameOf(spec.of)}: ${source}`;
  };
}
