import { Chip, Group } from "@mantine/core";
import { IconFileAlert } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { setsQuery } from "../../../api/sets";
import type { SetList } from "../../../api/types";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { DataTable } from "../../../ui/DataTable";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import room from "../../../ui/Room.module.css";
import { BackUp } from "./BackUp";
import { columnsOf, HIDDEN_FIRST } from "./columns";
import { ImportSet } from "./ImportSet";
import { pickedOf, toggled } from "./selection";
import { SelectionTools } from "./SelectionTools";
import { SetDetails } from "./SetDetails";
import { tagKey } from "./TagChips";
import classes from "./Library.module.css";

const TAGS = ["as-delivered", "golden", "as-found", "as-left"] as const;
const ALL = "all";

/** All sets that were ever taken, the newest first; one opened below, several picked for what comes next. */
export function LibraryTab() {
  const t = useTexts();
  const list = useQuery(setsQuery);
  const [search, update] = usePageSearch();
  const all = useMemo(() => list.data?.records ?? [], [list.data]);
  const tag = TAGS.find((one) => one === search.only);
  const shown = useMemo(
    () => (tag === undefined ? all : all.filter((one) => one.tags.some((given) => given.tag === tag))),
    [all, tag],
  );
  const picked = pickedOf(search);
  const records = all.filter((one) => picked.includes(one.id));
  const { sets } = search;
  const columns = useMemo(
    () =>
      columnsOf(t, pickedOf({ ...(sets ? { sets } : {}) }), (id) =>
        update({ sets: toggled(pickedOf({ ...(sets ? { sets } : {}) }), id) }),
      ),
    [t, sets, update],
  );
  const opened = all.find((one) => one.id === search.file);
  return (
    <div className={room.room}>
      <div className={room.strip}>
        <h1>{t("page.sets.tab.library")}</h1>
        <BackUp />
        <span className={room.spacer} />
        <ImportSet />
      </div>
      {list.isError && <ProblemAlert error={list.error} title={t("page.sets.failed")} />}
      {list.data && list.data.bad.length > 0 && <BadFiles list={list.data} />}
      <DataTable
        label={t("page.sets.tab.library")}
        rows={shown}
        columns={columns}
        idOf={(one) => one.id}
        fileName="hubside-sets"
        empty={t(
          list.isPending ? "page.loading" : tag === undefined ? "page.sets.none" : "page.sets.none_tagged",
        )}
        onOpen={(one) => update({ file: one.id })}
        selected={search.file}
        hiddenFirst={HIDDEN_FIRST}
        tools={
          records.length > 0 ? (
            <SelectionTools records={records} onClear={() => update({ sets: undefined })} />
          ) : (
            <TagFilter tag={tag ?? ALL} onTag={(to) => update({ only: to === ALL ? undefined : to })} />
          )
        }
      />
      {opened && <SetDetails key={opened.id} record={opened} />}
      {search.file !== undefined && list.isSuccess && !opened && (
        <p className={room.note}>{t("page.sets.gone", { name: search.file })}</p>
      )}
    </div>
  );
}

function TagFilter({ tag, onTag }: { tag: string; onTag: (tag: string) => void }) {
  const t = useTexts();
  return (
    <Chip.Group value={tag} onChange={(to) => onTag(to)}>
      <Group gap={6} role="radiogroup" aria-label={t("page.sets.column.tags")}>
        {[ALL, ...TAGS].map((one) => (
          <Chip key={one} value={one} size="sm" data-testid={`only-${one}`}>
            {t(one === ALL ? "page.sets.all" : tagKey(one as (typeof TAGS)[number]))}
          </Chip>
        ))}
      </Group>
    </Chip.Group>
  );
}

/** Files of the data folder that are no sets: each with its line and the reason. */
function BadFiles({ list }: { list: SetList }) {
  const t = useTexts();
  return (
    <details className={`${room.note} ${classes.bad}`} data-testid="bad-files">
      <summary>
        <IconFileAlert size={16} aria-hidden />{" "}
        {t(list.bad.length === 1 ? "page.sets.bad_one" : "page.sets.bad", {
          count: list.bad.length,
          folder: list.folder,
        })}
      </summary>
      <ul className={room.list}>
        {list.bad.map((one) => (
          <li key={one.name}>
            <span>{t("page.sets.bad_line", { name: one.name, line: one.line, reason: one.reason })}</span>
          </li>
        ))}
      </ul>
    </details>
  );
}
