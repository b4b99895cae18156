import { ActionIcon, Menu } from "@mantine/core";
import {
  IconArrowBarToLeft,
  IconArrowLeft,
  IconArrowRight,
  IconDots,
  IconHistoryToggle,
  IconX,
} from "@tabler/icons-react";
import { useNavigate } from "@tanstack/react-router";
import { type PageSearch, roomSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import type { Compared } from "./compared";
import classes from "./Compare.module.css";
import { Against, cellMarks, Mark } from "./marks";
import { moved, withReference } from "./specs";
import { turbineOf, useColumnTitle } from "./titles";

interface Props {
  compared: Compared;
  against: Against;
  /** Absent where the columns stay as they are. */
  onColumns?: (columns: string[]) => void;
}

/** What each column shows, in how many values it differs, and what can be done with it. */
export function CompareHead({ compared, against, onColumns }: Props) {
  const t = useTexts();
  const titleOf = useColumnTitle();
  const { columns, rows } = compared.doc;
  const several = new Set(columns.map((one) => turbineOf(one.device))).size > 1;
  const counts = columns.map(
    (_, at) =>
      rows.filter((row) => row.state === "different" && cellMarks(row.cells, against)[at] === Mark.Different)
        .length,
  );
  return columns.map((column, at) => {
    const { place, source, more } = titleOf(column, several);
    const reference = against === Against.Reference && at === 0;
    const count = counts[at] ?? 0;
    const said = reference
      ? t("page.compare.head.reference")
      : count === 0
        ? t("page.compare.head.none")
        : t(count === 1 ? "page.compare.head.differs_one" : "page.compare.head.differs", { count });
    return (
      <div
        key={column.spec}
        role="columnheader"
        data-column="column"
        data-reference={reference}
        data-testid={`head-${column.spec}`}
        title={[place, source, more, column.reason].filter(Boolean).join("\n")}
      >
        <div className={classes.columnHead}>
          <strong>{place}</strong>
          <em>{source}</em>
          {more !== "" && <em>{more}</em>}
          <small data-some={!reference && count > 0}>{said}</small>
        </div>
        {onColumns && (
          <ColumnMenu
            label={`${place}: ${source}`}
            at={at}
            columns={columns.map((one) => one.spec)}
            record={column.record}
            onColumns={onColumns}
          />
        )}
      </div>
    );
  });
}

interface MenuProps {
  label: string;
  at: number;
  columns: readonly string[];
  /** Record of the library; null where the column is none. */
  record: string | null;
  onColumns: (columns: string[]) => void;
}

function ColumnMenu({ label, at, columns, record, onColumns }: MenuProps) {
  const t = useTexts();
  const restore = useRestoreLink();
  const column = columns[at] ?? "";
  const item = (id: string, Icon: typeof IconX, act: () => void, disabled = false) => (
    <Menu.Item
      mih={40}
      leftSection={<Icon size={17} aria-hidden />}
      disabled={disabled}
      onClick={act}
      data-testid={`column-${id}`}
    >
      {t(`page.compare.column.${id}`)}
    </Menu.Item>
  );
  return (
    <Menu position="bottom-end">
      <Menu.Target>
        <ActionIcon
          variant="subtle"
          color="gray"
          aria-label={t("page.compare.column.menu", { column: label })}
          data-testid={`menu-${column}`}
        >
          <IconDots size={18} aria-hidden />
        </ActionIcon>
      </Menu.Target>
      <Menu.Dropdown>
        {item("reference", IconArrowBarToLeft, () => onColumns(withReference(columns, column)), at === 0)}
        {item("left", IconArrowLeft, () => onColumns(moved(columns, column, -1)), at === 0)}
        {item("right", IconArrowRight, () => onColumns(moved(columns, column, 1)), at === columns.length - 1)}
        {record !== null && item("restore", IconHistoryToggle, () => restore(record, []))}
        <Menu.Divider />
        {item("remove", IconX, () => onColumns(columns.filter((one) => one !== column)))}
      </Menu.Dropdown>
    </Menu>
  );
}

/** Goes to the restore of a set, of some addresses only where any are named. */
export function useRestoreLink(): (record: string, addresses: readonly string[]) => void {
  const navigate = useNavigate();
  return (record, addresses) =>
    void navigate({
      to: "/sets",
      search: (before: PageSearch) =>
        roomSearch(before, {
          tab: "restore",
          sets: record,
          ...(addresses.length > 0 && { select: addresses.join() }),
        }),
    });
}
