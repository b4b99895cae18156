/** What of a comparison is shown, as the URL holds it. */
import { useDeferredValue, useMemo } from "react";
import { type PageSearch, usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { useTyped } from "../../../ui/useTyped";
import type { RowActions } from "./CompareRow";
import { Rows, type View } from "./lines";

const setOf = (text: string | undefined): ReadonlySet<string> =>
  new Set((text ?? "").split(",").filter(Boolean));

function textOf(set: ReadonlySet<string>): string | undefined {
  return set.size === 0 ? undefined : [...set].join();
}

export interface TableView extends Omit<View, "groups"> {
  picked: ReadonlySet<string>;
  typed: string;
  onTyped: (text: string) => void;
}

export function useView(): TableView {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const [typed, onTyped] = useTyped(search.find ?? "", (text) => update({ find: text }));
  // The letter first, then the rows.
  const filter = useDeferredValue(typed);
  const { rows, group, closed, edit, select } = search;
  return useMemo(
    () => ({
      rows: rows === Rows.All ? Rows.All : Rows.Differences,
      filter,
      group,
      closed: setOf(closed),
      expanded: setOf(edit),
      picked: setOf(select),
      allowedTitle: t("page.compare.allowed"),
      typed,
      onTyped,
    }),
    [rows, filter, group, closed, edit, select, t, typed, onTyped],
  );
}

const PARTS = { fold: "closed", expand: "edit", pick: "select" } as const satisfies Record<
  string,
  keyof PageSearch
>;

/** Folding, unfolding and picking: each in its part of the URL, so that a link shows the same. */
export function useRowActions(): RowActions {
  const [search, update] = usePageSearch();
  const { closed, edit, select } = search;
  return useMemo(() => {
    const put = (part: keyof typeof PARTS, now: string | undefined, id: string, inside: boolean) => {
      const next = new Set(setOf(now));
      if (inside) next.add(id);
      else next.delete(id);
      update({ [PARTS[part]]: textOf(next) });
    };
    return {
      onFold: (section, open) => put("fold", closed, section, !open),
      onExpand: (address, open) => put("expand", edit, address, open),
      onPick: (address) => put("pick", select, address, !setOf(select).has(address)),
    };
  }, [closed, edit, select, update]);
}
