import { ActionIcon, Button, Checkbox, CloseButton, Menu, TextInput, Tooltip } from "@mantine/core";
import {
  IconCopy,
  IconDeviceFloppy,
  IconDownload,
  IconFilter,
  IconRefresh,
  IconRotateClockwise2,
  IconSquare,
  IconSquareCheck,
  IconTable,
} from "@tabler/icons-react";
import { type RefObject, useEffect, useRef, useState } from "react";
import type { EntryDoc } from "../../api/types";
import { usePageSearch } from "../../frame/search";
import type { ParameterRow } from "../../model/rows";
import { useTexts } from "../../texts/texts";
import { notify } from "../../ui/notices";
import { ALWAYS_SHOWN, cellText, Column } from "./columns";
import { useDevice } from "./context";
import { csvOf, download, tsvOf } from "./export";
import classes from "./Parameters.module.css";
import { RestartDialog, SaveDialog } from "./DeviceDialogs";
import { useReadAll } from "./readAll";
import { useSilent } from "./silent";

interface Props {
  filter: string;
  onFilter: (typed: string) => void;
  hidden: readonly string[];
  visible: RefObject<{ rows: ParameterRow[]; columns: Column[] }>;
  entries: readonly EntryDoc[];
}

export function Toolbar({ filter, onFilter, hidden, visible, entries }: Props) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  return (
    <div className={classes.toolbar} role="toolbar" aria-label={t("page.table.tools")}>
      <FilterInput filter={filter} onFilter={onFilter} />
      <Checkbox
        label={t("page.table.only_changed")}
        checked={search.only === "changed"}
        onChange={(event) => update({ only: event.currentTarget.checked ? "changed" : undefined })}
        data-testid="only-changed"
      />
      <TableMenu
        hidden={hidden}
        onHide={(ids) => update({ hide: ids.length === 0 ? "none" : ids.join() })}
        visible={visible}
      />
      <span className={classes.spacer} />
      <DeviceActions entries={entries} />
    </div>
  );
}

function FilterInput({ filter, onFilter }: { filter: string; onFilter: (typed: string) => void }) {
  const t = useTexts();
  const input = useRef<HTMLInputElement>(null);
  useEffect(() => {
    // "/" goes to the filter, as long as nothing is being typed elsewhere.
    const focus = (event: KeyboardEvent) => {
      const typing =
        event.target instanceof HTMLElement && event.target.closest("input, textarea, select, [role=dialog]");
      if (event.key !== "/" || typing) return;
      event.preventDefault();
      input.current?.focus();
    };
    window.addEventListener("keydown", focus);
    return () => window.removeEventListener("keydown", focus);
  }, []);
  return (
    <TextInput
      ref={input}
      className={classes.filter}
      aria-label={t("page.table.filter")}
      placeholder={t("page.table.filter_hint")}
      leftSection={<IconFilter size={17} aria-hidden />}
      rightSectionWidth={40}
      rightSection={
        filter !== "" && (
          <CloseButton aria-label={t("page.table.clear_filter")} onClick={() => onFilter("")} />
        )
      }
      value={filter}
      onChange={(event) => onFilter(event.currentTarget.value)}
      data-testid="filter"
    />
  );
}

interface MenuProps extends Pick<Props, "hidden" | "visible"> {
  onHide: (ids: string[]) => void;
}

/** Columns to show, and the rows shown as text to take along. */
function TableMenu({ hidden, onHide, visible }: MenuProps) {
  const t = useTexts();
  const { copy, save } = useTakeAlong(visible);
  const choices = Object.values(Column).filter((column) => !ALWAYS_SHOWN.includes(column));
  const toggle = (column: Column) =>
    onHide(choices.filter((one) => (one === column ? !hidden.includes(one) : hidden.includes(one))));
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
        {choices.map((column) => (
          <Menu.Item
            key={column}
            role="menuitemcheckbox"
            aria-checked={!hidden.includes(column)}
            closeMenuOnClick={false}
            mih={40}
            leftSection={
              hidden.includes(column) ? (
                <IconSquare size={17} aria-hidden />
              ) : (
                <IconSquareCheck size={17} aria-hidden />
              )
            }
            onClick={() => toggle(column)}
          >
            {t(`page.table.column.${column}`)}
          </Menu.Item>
        ))}
      </Menu.Dropdown>
    </Menu>
  );
}

function useTakeAlong(visible: Props["visible"]): { copy: () => void; save: () => void } {
  const t = useTexts();
  const context = useDevice();
  const table = () => {
    const { rows, columns } = visible.current;
    const heads = columns.map((column) => t(`page.table.column.${column}`));
    return [heads, ...rows.map((row) => columns.map((column) => cellText(column, row, context)))];
  };
  const copy = () => {
    const lines = table();
    const done = () =>
      notify({ tone: "ok", title: t("page.table.copied", { rows: lines.length - 1 }), lines: [] });
    const failed = () => notify({ tone: "error", title: t("page.table.copy_failed"), lines: [] });
    navigator.clipboard.writeText(tsvOf(lines)).then(done, failed);
  };
  return { copy, save: () => download(`${context.slug.replaceAll("/", "_")}.csv`, csvOf(table())) };
}

enum Dialog {
  Save,
  Restart,
}

function DeviceActions({ entries }: { entries: readonly EntryDoc[] }) {
  const t = useTexts();
  const { slug } = useDevice();
  const reading = useReadAll(slug);
  const silent = useSilent(slug);
  const [dialog, setDialog] = useState<Dialog | null>(null);
  const close = () => setDialog(null);
  return (
    <div className={classes.icons}>
      <Button
        px="sm"
        variant="default"
        leftSection={<IconRefresh size={17} aria-hidden />}
        disabled={silent || reading.running}
        onClick={() => reading.start(null)}
        data-testid="read-all"
      >
        {t("page.read.all")}
      </Button>
      <Button
        px="sm"
        leftSection={<IconDeviceFloppy size={17} aria-hidden />}
        disabled={silent}
        onClick={() => setDialog(Dialog.Save)}
        data-testid="save"
      >
        {t("page.save.open")}
      </Button>
      <Button
        px="sm"
        variant="default"
        leftSection={<IconRotateClockwise2 size={17} aria-hidden />}
        disabled={silent}
        onClick={() => setDialog(Dialog.Restart)}
        data-testid="restart"
      >
        {t("page.restart.open")}
      </Button>
      {dialog === Dialog.Save && <SaveDialog entries={entries} onClose={close} />}
      {dialog === Dialog.Restart && <RestartDialog entries={entries} onClose={close} />}
    </div>
  );
}
