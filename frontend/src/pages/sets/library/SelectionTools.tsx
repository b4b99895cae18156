import { Button, Menu } from "@mantine/core";
import { IconArrowBackUp, IconColumns, IconTag, IconX } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { queryClient } from "../../../api/queries";
import { library, setsQuery, type TagName } from "../../../api/sets";
import type { SetRecord } from "../../../api/types";
import { NeedsRole } from "../../../frame/NeedsRole";
import { useRole } from "../../../frame/role";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { notify } from "../../../ui/notices";
import { storyOf } from "../../../ui/problem";
import { columnsOf, restorable } from "./selection";
import { tagKey } from "./TagChips";

const BY_HAND: readonly TagName[] = ["as-delivered", "golden"];

/** What can be done with the sets that are picked: compare, restore, tag. */
export function SelectionTools({
  records,
  onClear,
}: {
  records: readonly SetRecord[];
  onClear?: () => void;
}) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const station = restorable(records);
  if (records.length === 0) return null;
  const leave = { find: undefined, order: undefined, less: undefined, file: undefined, only: undefined };
  return (
    <>
      <Button
        variant="default"
        px={12}
        leftSection={<IconColumns size={17} aria-hidden />}
        onClick={() => update({ ...leave, sets: undefined, tab: "compare", columns: columnsOf(records) })}
        data-testid="compare-sets"
      >
        {t(records.length === 1 ? "page.sets.compare_now" : "page.sets.compare", { count: records.length })}
      </Button>
      <Button
        variant="default"
        px={12}
        disabled={station === null}
        title={station === null ? t("page.sets.restore_one_station") : undefined}
        leftSection={<IconArrowBackUp size={17} aria-hidden />}
        onClick={() =>
          update({
            ...leave,
            tab: "restore",
            sets: records.map((one) => one.id).join(","),
            station: station ?? undefined,
          })
        }
        data-testid="restore-sets"
      >
        {t("page.sets.restore")}
      </Button>
      <NeedsRole role="technician">{(locked) => <TagMenu records={records} locked={locked} />}</NeedsRole>
      {onClear && (
        <Button
          variant="subtle"
          leftSection={<IconX size={17} aria-hidden />}
          onClick={onClear}
          data-testid="clear-picked"
        >
          {t("page.sets.clear_picked", { count: records.length })}
        </Button>
      )}
    </>
  );
}

function TagMenu({ records, locked }: { records: readonly SetRecord[]; locked: boolean }) {
  const t = useTexts();
  const { why } = useRole();
  const change = useMutation({
    mutationFn: ({ tag, on }: { tag: TagName; on: boolean }) =>
      Promise.all(records.map((one) => library.tag(one.id, tag, on))),
    onError: (error) => {
      const story = storyOf(error, t);
      notify({ tone: "error", title: t("page.sets.tag_failed"), lines: [story.happened, story.next] });
    },
    onSettled: () => queryClient.invalidateQueries({ queryKey: setsQuery.queryKey }),
  });
  return (
    <Menu position="bottom-end" withinPortal>
      <Menu.Target>
        <Button
          variant="default"
          px={12}
          disabled={locked}
          loading={change.isPending}
          leftSection={<IconTag size={17} aria-hidden />}
          data-testid="tag-menu"
        >
          {t("page.sets.tag")}
        </Button>
      </Menu.Target>
      <Menu.Dropdown>
        {BY_HAND.map((tag) => {
          const on = !records.every((one) => one.tags.some((given) => given.tag === tag));
          const refused = tag === "golden" ? why("expert") : null;
          return (
            <Menu.Item
              key={tag}
              disabled={refused !== null}
              onClick={() => change.mutate({ tag, on })}
              data-testid={`give-${tag}`}
            >
              {t(on ? "page.sets.tag_as" : "page.sets.tag_off", { tag: t(tagKey(tag)) })}
              {refused !== null && <span className="dim"> · {refused}</span>}
            </Menu.Item>
          );
        })}
      </Menu.Dropdown>
    </Menu>
  );
}
