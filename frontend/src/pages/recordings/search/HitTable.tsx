import { useMemo } from "react";
import type { Hit, Search } from "../../../api/search";
import { digitsOf } from "../../../api/trace";
import { usePageSearch } from "../../../frame/search";
import { useOpenReplay } from "../../../replay/leaving";
import { type Translate, useTexts } from "../../../texts/texts";
import { DataTable, type TableColumn } from "../../../ui/DataTable";
import { dateAndTime } from "../../../ui/format";

/** Where it was found; each row leads to the moment in its recording. */
export function HitTable({ search }: { search: Search | undefined }) {
  const t = useTexts();
  const replay = useOpenReplay();
  const [page] = usePageSearch();
  const columns = useMemo(() => columnsOf(t), [t]);
  const state = search === undefined ? "before" : search.state === "running" ? "running" : "nothing";
  return (
    <DataTable
      label={t("page.search.hits")}
      rows={search?.hits ?? []}
      columns={columns}
      idOf={idOf}
      fileName="hubside-search"
      empty={t(`page.search.empty.${state}`)}
      onOpen={(hit) => replay(hit.name, hit.t_ns)}
      selected={page.file}
      name="hit"
      live={search?.state === "running"}
    />
  );
}

const idOf = (hit: Hit): string => `${hit.name} ${digitsOf(hit.t_ns)} ${hit.bus ?? ""} ${hit.node ?? ""}`;

function columnsOf(t: Translate): TableColumn<Hit>[] {
  const title = (id: string) => t(`page.search.column.${id}`);
  return [
    {
      id: "time",
      title: title("time"),
      width: "190px",
      fixed: true,
      text: (hit) => dateAndTime(hit.t_ns / 1e6),
      by: (hit) => hit.t_ns,
    },
    {
      id: "turbine",
      title: title("turbine"),
      width: "minmax(80px, 0.6fr)",
      text: (hit) => hit.turbine.toUpperCase(),
    },
    {
      id: "says",
      title: title("says"),
      width: "minmax(220px, 3fr)",
      fixed: true,
      text: (hit) => hit.says[t.language],
    },
    { id: "file", title: title("file"), width: "minmax(140px, 1.4fr)", text: (hit) => hit.name },
  ];
}
