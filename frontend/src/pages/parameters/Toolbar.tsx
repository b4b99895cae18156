import { ActionIcon, Button, CloseButton, Menu, TextInput, Tooltip } from "@mantine/core";
import {
  IconAdjustmentsHorizontal,
  IconFilter,
  IconListTree,
  IconSquare,
  IconSquareCheck,
} from "@tabler/icons-react";
import { memo, startTransition, useEffect, useRef, useState } from "react";
import type { GroupTally } from "../../model/rows";
import { useTexts } from "../../texts/texts";
import { CompareMenu } from "./CompareMenu";
import { useBenchOfTable } from "./context";
import { DeviceActions } from "./DeviceActions";
import { Tally } from "./Lines";
import { Only } from "./only";
import classes from "./Parameters.module.css";
import { TableMenu, type Visible } from "./TableMenu";

interface Props {
  filter: string;
  onFilter: (typed: string) => void;
  /** From the filter into the table. */
  onEnter: () => void;
  only: ReadonlySet<Only>;
  onOnly: (only: ReadonlySet<Only>) => void;
  hidden: readonly string[];
  onHide: (ids: string[]) => void;
  visible: Visible;
  tally: GroupTally;
  onJump: (group: string) => void;
}

export const Toolbar = memo(function Toolbar(props: Props) {
  const t = useTexts();
  return (
    <div className={classes.toolbar} role="toolbar" aria-label={t("page.table.tools")}>
      <FilterInput filter={props.filter} onFilter={props.onFilter} onEnter={props.onEnter} />
      <GroupMenu tally={props.tally} onJump={props.onJump} />
      <TableMenu hidden={props.hidden} onHide={props.onHide} visible={props.visible} />
      <OnlyMenu only={props.only} onOnly={props.onOnly} />
      <CompareMenu />
      <span className={classes.spacer} />
      <DeviceActions />
    </div>
  );
});

/** Only the field itself is drawn with a key; the table follows as a transition, which the next key interrupts. */
function FilterInput({ filter, onFilter, onEnter }: Pick<Props, "filter" | "onFilter" | "onEnter">) {
  const t = useTexts();
  const input = useRef<HTMLInputElement>(null);
  const [typed, setTyped] = useState(filter);
  const change = (text: string) => {
    setTyped(text);
    startTransition(() => onFilter(text));
  };
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
        typed !== "" && <CloseButton aria-label={t("page.table.clear_filter")} onClick={() => change("")} />
      }
      value={typed}
      onChange={(event) => change(event.currentTarget.value)}
      onKeyDown={(event) => {
        if (event.key !== "ArrowDown" && event.key !== "Enter") return;
        event.preventDefault();
        onEnter();
      }}
      data-testid="filter"
    />
  );
}

/** Two filters are at hand where there is room; a filter that is set is always seen, as it hides rows. */
const AT_HAND: readonly Only[] = [Only.Different, Only.Changed];

function OnlyMenu({ only, onOnly }: Pick<Props, "only" | "onOnly">) {
  const t = useTexts();
  const { siblings } = useBenchOfTable();
  const choices = Object.values(Only).filter((one) => one !== Only.Different || siblings.length > 1);
  const toggle = (one: Only) => {
    const next = new Set(only);
    if (!next.delete(one)) next.add(one);
    onOnly(next);
  };
  return (
    <>
      <Menu position="bottom-start" closeOnItemClick={false}>
        <Menu.Target>
          <Tooltip label={t("page.only.menu")}>
            <ActionIcon aria-label={t("page.only.menu")} data-testid="only-menu">
              <IconAdjustmentsHorizontal size={18} aria-hidden />
            </ActionIcon>
          </Tooltip>
        </Menu.Target>
        <Menu.Dropdown>
          <Menu.Label>{t("page.only.label")}</Menu.Label>
          {choices.map((one) => {
            const Box = only.has(one) ? IconSquareCheck : IconSquare;
            return (
              <Menu.Item
                key={one}
                role="menuitemcheckbox"
                aria-checked={only.has(one)}
                mih={40}
                leftSection={<Box size={17} aria-hidden />}
                onClick={() => toggle(one)}
                data-testid={`only-${one}`}
              >
                {t(`page.only.${one}`)}
              </Menu.Item>
            );
          })}
        </Menu.Dropdown>
      </Menu>
      {choices
        .filter((one) => only.has(one) || AT_HAND.includes(one))
        .map((one) => (
          <Button
            key={one}
            className={only.has(one) ? undefined : classes.atHand}
            variant={only.has(one) ? "light" : "default"}
            px="sm"
            rightSection={only.has(one) ? <span aria-hidden>✕</span> : undefined}
            aria-pressed={only.has(one)}
            onClick={() => toggle(one)}
            data-testid={`toggle-${one}`}
          >
            {t(`page.only.${one}`)}
          </Button>
        ))}
    </>
  );
}

function GroupMenu({ tally, onJump }: Pick<Props, "tally" | "onJump">) {
  const t = useTexts();
  const { devices } = useBenchOfTable();
  const groups = (devices[0]?.doc.groups ?? []).filter((group) => tally.has(group.id));
  return (
    <Menu position="bottom-start">
      <Menu.Target>
        <Tooltip label={t("page.table.groups")}>
          <ActionIcon aria-label={t("page.table.groups")} data-testid="groups">
            <IconListTree size={18} aria-hidden />
          </ActionIcon>
        </Tooltip>
      </Menu.Target>
      <Menu.Dropdown mah={480} className={classes.groupMenu}>
        <Menu.Label>{t("page.table.groups")}</Menu.Label>
        {groups.map((group) => (
          <Menu.Item
            key={group.id}
            mih={40}
            onClick={() => onJump(group.id)}
            data-testid={`jump-${group.id}`}
          >
            <span className={classes.groupItem}>
              {t(group.text_key)} <Tally tally={tally.get(group.id)} t={t} />
            </span>
          </Menu.Item>
        ))}
      </Menu.Dropdown>
    </Menu>
  );
}
