import { Button, Checkbox, Popover } from "@mantine/core";
import { IconListCheck } from "@tabler/icons-react";
import { useTexts } from "../../../texts/texts";
import { groupsOf, isPicked, type PlanLine } from "./plan";
import classes from "./Restore.module.css";

interface Props {
  lines: readonly PlanLine[];
  onPick: (changed: readonly PlanLine[], on: boolean) => void;
}

/** What differs, group by group: a whole group is put in or taken out at once. */
export function GroupMenu({ lines, onPick }: Props) {
  const t = useTexts();
  const groups = groupsOf(lines);
  const all = groups.flatMap((group) => group.lines);
  const count = all.filter(isPicked).length;
  if (all.length === 0) return null;
  return (
    <Popover position="bottom-end" withinPortal trapFocus>
      <Popover.Target>
        <Button
          variant="default"
          leftSection={<IconListCheck size={17} aria-hidden />}
          data-testid="pick-groups"
        >
          {t("page.restoring.picked", { count, total: all.length })}
        </Button>
      </Popover.Target>
      <Popover.Dropdown>
        <div className={classes.groups} role="group" aria-label={t("page.restoring.groups")}>
          <Line title={t("page.restoring.everything")} lines={all} onPick={onPick} id="all" />
          {groups.map((group) => (
            <Line key={group.id} title={group.title} lines={group.lines} onPick={onPick} id={group.id} />
          ))}
        </div>
      </Popover.Dropdown>
    </Popover>
  );
}

function Line({ title, lines, onPick, id }: Props & { title: string; id: string }) {
  const count = lines.filter(isPicked).length;
  return (
    <div className={classes.group}>
      <Checkbox
        label={title}
        checked={count === lines.length}
        indeterminate={count > 0 && count < lines.length}
        onChange={() => onPick(lines, count < lines.length)}
        data-testid={`pick-group-${id}`}
      />
      <span className="dim">
        {count} / {lines.length}
      </span>
    </div>
  );
}
