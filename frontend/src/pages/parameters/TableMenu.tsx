import { ActionIcon, Menu, Tooltip } from "@mantine/core";
import { IconCopy, IconDownload, IconSquare, IconSquareCheck, IconTable } from "@tabler/icons-react";
import type { RefObject } from "react";
import type { ParameterRow } from "../../model/rows";
import { useTexts } from "../../texts/texts";
import { notify } from "../../ui/notices";
import { cellText, choicesOf, type ColumnSpec } from "./columns";
import { type Bench, useBenchOfTable } from "./context";
import { csvOf, download, tsvOf } from "../../ui/export";

/** What the table shows at this moment, in its order. */
export type Visible = RefObject<{ rows: readonly ParameterRow[]; columns: readonly ColumnSpec[] }>;

interface Props {
  hidden: readonly string[];
  visible: Visible;
  onHide: (ids: string[]) => void;
}

/** Columns to show, and the rows shown as text to take along. */
export function TableMenu({ hidden, onHide, visible }: Props) {
  const t = useTexts();
  const bench = useBenchOfTable();
  const { copy, save } = useTakeAlong(visible, bench);
  const choices = choicesOf(bench.side);
  const toggle = (column: string) => {
    const next = new Set(hidden);
    if (!next.delete(column)) next.add(column);
    onHide([...next]);
  };
  return (
    <Menu position="bottom-start">
      <Menu.Target>
        <Tooltip label={t("page.table.menu")}>
          <ActionIcon aria-label={t("page.table.menu")} data-testid="table-menu">
            <IconTable size={18} aria-hidden />
          </ActionIcon>
        </Tooltip>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Item mih={40} leftSection={<IconCopy size={17} aria-hidden />} onClick={copy}>
          {t("page.table.copy")}
        </Menu.Item>
        <Menu.Item mih={40} leftSection={<IconDownload size={17} aria-hidden />} onClick={save}>
          {t("page.table.export")}
        </Menu.Item>
        <Menu.Divider />
        <Menu.Label>{t("page.table.columns")}</Menu.Label>
        {choices.map((column) => {
          const Box = hidden.includes(column) ? IconSquare : IconSquareCheck;
          return (
            <Menu.Item
              key={column}
              role="menuitemcheckbox"
              aria-checked={!hidden.includes(column)}
              closeMenuOnClick={false}
              mih={40}
              leftSection={<Box size={17} aria-hidden />}
              onClick={() => toggle(column)}
            >
              {t(`page.table.column.${column}`)}
            </Menu.Item>
          );
        })}
      </Menu.Dropdown>
    </Menu>
  );
}

function useTakeAlong(visible: Visible, bench: Bench): { copy: () => void; save: () => void } {
  const t = useTexts();
  const table = () => {
    const { rows, columns } = visible.current;
    const heads = columns.map((column) => column.label);
    return [heads, ...rows.map((row) => columns.map((column) => cellText(column, row, bench)))];
  };
  const copy = () => {
    const lines = table();
    const done = () =>
      notify({ tone: "ok", title: t("page.table.copied", { rows: lines.length - 1 }), lines: [] });
    const failed = () => notify({ tone: "error", title: t("page.table.copy_failed"), lines: [] });
    navigator.clipboard.writeText(tsvOf(lines)).then(done, failed);
  };
  const [first] = bench.devices;
  const name = bench.side ? `${first?.slug.split("/")[0] ?? ""}_${first?.doc.id ?? ""}` : first?.slug;
  return { copy, save: () => download(`${(name ?? "").replaceAll("/", "_")}.csv`, csvOf(table())) };
}
