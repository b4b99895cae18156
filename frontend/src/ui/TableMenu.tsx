import { ActionIcon, Menu, Tooltip } from "@mantine/core";
import { IconCopy, IconDownload, IconSquare, IconSquareCheck, IconTable } from "@tabler/icons-react";
import { csvOf, download, tsvOf } from "./export";
import { useTexts } from "../texts/texts";
import type { ArrangedTable, TableColumn } from "./arrange";
import { notify } from "./notices";

interface Props<Row> {
  table: ArrangedTable<Row>;
  columns: readonly TableColumn<Row>[];
  /** What is shown, with its heads. */
  texts: () => string[][];
  fileName: string;
}

/** The rows shown as text to take along, and the columns to show. */
export function TableMenu<Row>({ table, columns, texts, fileName }: Props<Row>) {
  const t = useTexts();
  const copy = () => {
    const lines = texts();
    navigator.clipboard
      .writeText(tsvOf(lines))
      .then(() =>
        notify({ tone: "ok", title: t("page.table.copied", { rows: lines.length - 1 }), lines: [] }),
      )
      .catch(() => notify({ tone: "error", title: t("page.table.copy_failed"), lines: [] }));
  };
  return (
    <Menu position="bottom-start">
      <Menu.Target>
        <Tooltip label={t("page.table.menu")}>
          <ActionIcon aria-label={t("page.table.menu")} data-testid="files-menu">
            <IconTable size={18} aria-hidden />
          </ActionIcon>
        </Tooltip>
      </Menu.Target>
      <Menu.Dropdown mah="70vh" style={{ overflow: "auto" }}>
        <Menu.Item
          mih={40}
          leftSection={<IconCopy size={17} aria-hidden />}
          onClick={copy}
          data-testid="table-copy"
        >
          {t("page.table.copy")}
        </Menu.Item>
        <Menu.Item
          mih={40}
          leftSection={<IconDownload size={17} aria-hidden />}
          onClick={() => download(`${fileName}.csv`, csvOf(texts()))}
          data-testid="table-csv"
        >
          {t("page.table.export")}
        </Menu.Item>
        <Menu.Divider />
        <Menu.Label>{t("page.table.columns")}</Menu.Label>
        {columns.map(({ id, title }) => {
          const column = table.getColumn(id);
          if (column?.getCanHide() !== true) return null;
          const shown = column.getIsVisible();
          const Box = shown ? IconSquareCheck : IconSquare;
          return (
            <Menu.Item
              key={id}
              mih={40}
              role="menuitemcheckbox"
              aria-checked={shown}
              closeMenuOnClick={false}
              leftSection={<Box size={17} aria-hidden />}
              onClick={() => column.toggleVisibility()}
              data-testid={`column-${id}`}
            >
              {title}
            </Menu.Item>
          );
        })}
      </Menu.Dropdown>
    </Menu>
  );
}
