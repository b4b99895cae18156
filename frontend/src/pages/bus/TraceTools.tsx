import { ActionIcon, Button, Menu, TextInput, Tooltip } from "@mantine/core";
import {
  IconAlertOctagon,
  IconCopy,
  IconDownload,
  IconFilterOff,
  IconPlayerPause,
  IconPlayerPlay,
  IconSearch,
  IconSquare,
  IconSquareCheck,
  IconTable,
} from "@tabler/icons-react";
import { type ReactNode, useEffect, useState } from "react";
import { useBusNodes } from "../../api/trace";
import { usePageSearch } from "../../frame/search";
import { useTexts } from "../../texts/texts";
import { useDeviceName } from "../../ui/devices";
import { notify } from "../../ui/notices";
import { csvOf, download, tsvOf } from "../../ui/export";
import classes from "./Bus.module.css";
import { Direction } from "./Direction";
import { GROUPS, isFiltered, listOf, NO_FILTER } from "./filter";
import { table } from "./lines";
import type { useTrace } from "./useTrace";

const TYPING_MS = 250;

export function TraceTools({ trace }: { trace: ReturnType<typeof useTrace> }) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const { paused, view } = trace;
  return (
    <div className={classes.toolbar} role="toolbar" aria-label={t("trace.page.filters")}>
      <Button
        variant={paused ? "filled" : "default"}
        leftSection={
          paused ? <IconPlayerPlay size={17} aria-hidden /> : <IconPlayerPause size={17} aria-hidden />
        }
        onClick={paused ? trace.resume : trace.pause}
        data-testid="trace-pause"
        className={classes.pause ?? ""}
      >
        {t(paused ? "trace.page.resume" : "trace.page.pause")}
      </Button>
      <Typed name="q" label="search" hint="search_hint" icon={<IconSearch size={16} aria-hidden />} />
      <NodesMenu />
      <Choices
        label={t("trace.page.services")}
        all={t("trace.page.services_all")}
        choices={Object.keys(GROUPS).map((group) => [group, t(`trace.group.${group}`)])}
        chosen={listOf(search.services)}
        onChoose={(chosen) => update({ services: chosen.join() || undefined })}
        testId="trace-services"
      />
      <Direction />
      <Typed name="ids" label="ids" hint="ids_hint" width={130} />
      <Typed name="data" label="data" hint="data_hint" width={120} />
      <Tooltip label={t("trace.page.errors")}>
        <Button
          px="sm"
          variant={search.errors ? "filled" : "default"}
          color="red"
          aria-pressed={search.errors !== undefined}
          leftSection={<IconAlertOctagon size={17} aria-hidden />}
          onClick={() => update({ errors: search.errors ? undefined : "1" })}
          data-testid="trace-errors"
        >
          {t("trace.page.errors")}
        </Button>
      </Tooltip>
      {isFiltered(search) && (
        <Tooltip label={t("trace.page.clear")}>
          <ActionIcon
            aria-label={t("trace.page.clear")}
            onClick={() => update(NO_FILTER)}
            data-testid="trace-clear"
          >
            <IconFilterOff size={18} aria-hidden />
          </ActionIcon>
        </Tooltip>
      )}
      <TakeAlong rows={view.rows} />
      {view.invalid !== null && (
        <span className={`${classes.invalid} tone-error`} role="alert">
          {view.invalid}
        </span>
      )}
    </div>
  );
}

interface TypedProps {
  name: "q" | "ids" | "data";
  label: string;
  hint: string;
  width?: number;
  icon?: ReactNode;
}

/** A filter that is typed; it counts as soon as the typing pauses. */
function Typed({ name, label, hint, width, icon }: TypedProps) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const known = search[name] ?? "";
  const [typed, setTyped] = useState(known);
  const [seen, setSeen] = useState(known);
  if (seen !== known) {
    // Changed by a link or by "clear": what is typed follows.
    setSeen(known);
    setTyped(known);
  }
  useEffect(() => {
    if (typed === known) return;
    const timer = setTimeout(() => update({ [name]: typed.trim() === "" ? undefined : typed }), TYPING_MS);
    return () => clearTimeout(timer);
  }, [typed, known, name, update]);
  return (
    <TextInput
      aria-label={t(`trace.page.${label}`)}
      placeholder={t(`trace.page.${width === undefined ? hint : label}`)}
      title={`${t(`trace.page.${label}`)}: ${t(`trace.page.${hint}`)}`}
      className={width === undefined ? (classes.grow ?? "") : ""}
      leftSection={icon}
      w={width}
      value={typed}
      onChange={(event) => setTyped(event.currentTarget.value)}
      data-testid={`trace-${name}`}
    />
  );
}

function NodesMenu() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const nameOf = useDeviceName();
  const nodes = useBusNodes();
  const choices = nodes.map((one): [string, string] => [
    String(one.node),
    `${String(one.node)}  ${one.device === null ? t("trace.table.foreign") : nameOf(one.device)}`,
  ]);
  return (
    <Choices
      label={t("trace.page.nodes")}
      all={t("trace.page.nodes_all")}
      choices={choices}
      chosen={listOf(search.nodes)}
      onChoose={(chosen) => update({ nodes: chosen.join() || undefined })}
      testId="trace-nodes"
    />
  );
}

interface ChoicesProps {
  label: string;
  all: string;
  choices: [string, string][];
  chosen: string[];
  onChoose: (chosen: string[]) => void;
  testId: string;
}

/** Several of a few; none means all. */
function Choices({ label, all, choices, chosen, onChoose, testId }: ChoicesProps) {
  const names = choices
    .filter(([id]) => chosen.includes(id))
    .map(([, name]) => name.split("  ").at(-1) ?? "");
  const toggle = (id: string) =>
    onChoose(chosen.includes(id) ? chosen.filter((one) => one !== id) : [...chosen, id]);
  const shown =
    names.length === 0 ? all : names.length === 1 ? names[0] : `${label}: ${String(names.length)}`;
  return (
    <Menu position="bottom-start" closeOnItemClick={false}>
      <Menu.Target>
        <Button variant={chosen.length > 0 ? "light" : "default"} px="sm" data-testid={testId}>
          {shown}
        </Button>
      </Menu.Target>
      <Menu.Dropdown mah={420} style={{ overflow: "auto" }}>
        {choices.map(([id, name]) => (
          <Menu.Item
            key={id}
            mih={40}
            role="menuitemcheckbox"
            aria-checked={chosen.includes(id)}
            leftSection={
              chosen.includes(id) ? (
                <IconSquareCheck size={17} aria-hidden />
              ) : (
                <IconSquare size={17} aria-hidden />
              )
            }
            onClick={() => toggle(id)}
            data-testid={`${testId}-${id}`}
          >
            {name}
          </Menu.Item>
        ))}
      </Menu.Dropdown>
    </Menu>
  );
}

function TakeAlong({ rows }: { rows: Parameters<typeof table>[0] }) {
  const t = useTexts();
  const copy = () => {
    const lines = table(rows, t);
    const done = () =>
      notify({ tone: "ok", title: t("trace.page.copied", { rows: lines.length - 1 }), lines: [] });
    const failed = () => notify({ tone: "error", title: t("trace.page.copy_failed"), lines: [] });
    navigator.clipboard.writeText(tsvOf(lines)).then(done, failed);
  };
  return (
    <Menu position="bottom-end">
      <Menu.Target>
        <Tooltip label={t("trace.page.export")}>
          <ActionIcon aria-label={t("trace.page.export")} data-testid="trace-export">
            <IconTable size={18} aria-hidden />
          </ActionIcon>
        </Tooltip>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Item mih={40} leftSection={<IconCopy size={17} aria-hidden />} onClick={copy}>
          {t("trace.page.copy")}
        </Menu.Item>
        <Menu.Item
          mih={40}
          leftSection={<IconDownload size={17} aria-hidden />}
          onClick={() => download("trace.csv", csvOf(table(rows, t)))}
          data-testid="trace-csv"
        >
          {t("trace.page.export")}
        </Menu.Item>
      </Menu.Dropdown>
    </Menu>
  );
}
