import { Button, CloseButton, Menu, SegmentedControl, TextInput } from "@mantine/core";
import { IconChevronDown, IconDownload, IconFilter, IconHistoryToggle } from "@tabler/icons-react";
import type { ReactNode } from "react";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import type { Compared } from "./compared";
import classes from "./Compare.module.css";
import { useRestoreLink } from "./CompareHead";
import { Rows } from "./lines";
import { useColumnTitle } from "./titles";

const LABEL = { minHeight: 40, display: "flex", alignItems: "center", justifyContent: "center" };
const EVERY = "";

interface Props {
  compared: Compared;
  shown: number;
  picked: readonly string[];
  /** Before the filter: what chooses the columns. */
  first?: ReactNode;
  onExport: (format: "html" | "csv") => void;
  /** From the filter into the table. */
  onEnter: () => void;
  typed: string;
  onTyped: (text: string) => void;
}

export function Toolbar(props: Props) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  return (
    <div className={classes.toolbar} role="toolbar" aria-label={t("page.table.tools")}>
      {props.first}
      <SegmentedControl
        aria-label={t("page.compare.rows.label")}
        size="sm"
        styles={{ label: LABEL }}
        data={[Rows.Differences, Rows.All].map((value) => ({
          value,
          label: t(`page.compare.rows.${value}`),
        }))}
        value={search.rows === Rows.All ? Rows.All : Rows.Differences}
        onChange={(rows) => update({ rows: rows === Rows.All ? rows : undefined })}
        data-testid="rows"
      />
      <TextInput
        className={classes.filter ?? ""}
        aria-label={t("page.files.filter")}
        placeholder={t("page.files.filter")}
        leftSection={<IconFilter size={17} aria-hidden />}
        rightSectionWidth={40}
        rightSection={
          props.typed !== "" && (
            <CloseButton aria-label={t("page.table.clear_filter")} onClick={() => props.onTyped("")} />
          )
        }
        value={props.typed}
        onChange={(event) => props.onTyped(event.currentTarget.value)}
        onKeyDown={(event) => {
          if (event.key !== "Enter" && event.key !== "ArrowDown") return;
          event.preventDefault();
          props.onEnter();
        }}
        data-testid="compare-find"
      />
      <GroupMenu compared={props.compared} />
      <span className="dim" data-testid="compare-count">
        {t("page.table.count", { shown: props.shown, total: props.compared.rows.length })}
      </span>
      <span className={classes.spacer} />
      <RestorePicked compared={props.compared} picked={props.picked} />
      <ExportMenu onExport={props.onExport} />
    </div>
  );
}

function GroupMenu({ compared }: { compared: Compared }) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const tally = new Map<string, { title: string; count: number }>();
  for (const { row, groupTitle } of compared.rows) {
    const before = tally.get(row.group)?.count ?? 0;
    tally.set(row.group, { title: groupTitle, count: before + (row.state === "same" ? 0 : 1) });
  }
  const order = [...compared.groups, ...[...tally.keys()].filter((id) => !compared.groups.includes(id))];
  const chosen = search.group === undefined ? undefined : tally.get(search.group);
  return (
    <Menu position="bottom-start">
      <Menu.Target>
        <Button
          variant={chosen ? "light" : "default"}
          px="sm"
          rightSection={<IconChevronDown size={15} aria-hidden />}
          data-testid="compare-group"
        >
          {chosen?.title ?? t("page.compare.every_group")}
        </Button>
      </Menu.Target>
      <Menu.Dropdown mah={460} style={{ overflow: "auto" }}>
        {[EVERY, ...order].map((id) => {
          const one = tally.get(id);
          if (id !== EVERY && !one) return null;
          return (
            <Menu.Item
              key={id}
              mih={40}
              role="menuitemradio"
              aria-checked={(search.group ?? EVERY) === id}
              onClick={() => update({ group: id === EVERY ? undefined : id })}
              data-testid={`group-${id}`}
              rightSection={one && one.count > 0 ? <span className="dim">≠ {one.count}</span> : undefined}
            >
              {one?.title ?? t("page.compare.every_group")}
            </Menu.Item>
          );
        })}
      </Menu.Dropdown>
    </Menu>
  );
}

function ExportMenu({ onExport }: { onExport: Props["onExport"] }) {
  const t = useTexts();
  return (
    <Menu position="bottom-end">
      <Menu.Target>
        <Button
          variant="default"
          px="sm"
          leftSection={<IconDownload size={17} aria-hidden />}
          data-testid="compare-export"
        >
          {t("page.compare.export.open")}
        </Button>
      </Menu.Target>
      <Menu.Dropdown>
        {(["html", "csv"] as const).map((format) => (
          <Menu.Item key={format} mih={40} onClick={() => onExport(format)} data-testid={`export-${format}`}>
            {t(`page.compare.export.${format}`)}
          </Menu.Item>
        ))}
      </Menu.Dropdown>
    </Menu>
  );
}

/** "Restore these from ...": each column that is a set of the library. */
function RestorePicked({ compared, picked }: { compared: Compared; picked: readonly string[] }) {
  const t = useTexts();
  const restore = useRestoreLink();
  const titleOf = useColumnTitle();
  const sets = compared.doc.columns.flatMap((one) =>
    one.record === null ? [] : [{ ...one, record: one.record }],
  );
  if (sets.length === 0 || picked.length === 0) return null;
  return (
    <Menu position="bottom-end">
      <Menu.Target>
        <Button
          px="sm"
          leftSection={<IconHistoryToggle size={17} aria-hidden />}
          rightSection={<IconChevronDown size={15} aria-hidden />}
          data-testid="restore-picked"
        >
          {t("page.compare.restore", { count: picked.length })}
        </Button>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Label>{t("page.compare.restore_from")}</Menu.Label>
        {sets.map((column) => {
          const { place, source, more } = titleOf(column, true);
          return (
            <Menu.Item
              key={column.spec}
              mih={40}
              onClick={() => restore(column.record, picked)}
              data-testid={`restore-${column.spec}`}
            >
              {[place, source, more].filter(Boolean).join(" · ")}
            </Menu.Item>
          );
        })}
      </Menu.Dropdown>
    </Menu>
  );
}
