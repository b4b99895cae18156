import { Button, Menu } from "@mantine/core";
import { IconArrowBackUp, IconPencilCheck, IconTrash } from "@tabler/icons-react";
import { usePageSearch } from "../../frame/search";
import { type Change, keyOf, type UndoSet } from "../../model/staged";
import { useTexts } from "../../texts/texts";
import { timeOfDay } from "../../ui/format";
import { notify } from "../../ui/notices";
import classes from "./Parameters.module.css";
import { staged, useStaged } from "./staging";
import { useWriting } from "./writing";

/** How much is pending or under way, and the way to its review; writes of before can be taken back. */
export function PendingBar() {
  const t = useTexts();
  const [, update] = usePageSearch();
  const { changes, undo } = useStaged();
  const { job, running } = useWriting();
  const devices = new Set([...changes.values()].map((one) => one.device)).size;
  const review = () => update({ review: "open" });
  if (changes.size === 0 && undo.length === 0 && !running) return null;
  return (
    <div className={classes.pendingBar} data-some={changes.size > 0 || running}>
      {running && (
        <span role="status">
          {t("page.review.writing", { done: job?.done ?? 0, total: job?.total ?? 0 })}
        </span>
      )}
      {!running && changes.size > 0 && (
        <span role="status" data-testid="pending-count">
          {t("page.review.pending", { count: changes.size, devices })}
        </span>
      )}
      {undo.length > 0 && !running && <UndoMenu sets={undo} />}
      {changes.size > 0 && !running && <Discard changes={[...changes.values()]} />}
      {(changes.size > 0 || running) && (
        <Button leftSection={<IconPencilCheck size={17} aria-hidden />} onClick={review} data-testid="review">
          {t(running ? "page.review.show" : "page.review.open")}
        </Button>
      )}
    </div>
  );
}

/** Takes all that is pending out; a notice offers to bring it back. */
function Discard({ changes }: { changes: readonly Change[] }) {
  const t = useTexts();
  const discard = () => {
    staged.drop(changes.map((one) => keyOf(one.device, one.address)));
    notify({
      tone: "ok",
      title: t("page.review.discarded", { count: changes.length }),
      lines: [],
      action: { label: t("page.review.discard_undo"), run: () => staged.stage(changes) },
    });
  };
  return (
    <Button
      variant="subtle"
      px="sm"
      leftSection={<IconTrash size={17} aria-hidden />}
      onClick={discard}
      data-testid="discard"
    >
      {t("page.review.discard")}
    </Button>
  );
}

function UndoMenu({ sets }: { sets: readonly UndoSet[] }) {
  const t = useTexts();
  return (
    <Menu position="bottom-end">
      <Menu.Target>
        <Button
          variant="default"
          leftSection={<IconArrowBackUp size={17} aria-hidden />}
          data-testid="undo-menu"
        >
          {t("page.undo.menu")}
        </Button>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Label>{t("page.undo.label")}</Menu.Label>
        {sets.map((set) => (
          <Menu.Item key={set.id} mih={40} onClick={() => staged.undo(set)} data-testid={`undo-${set.id}`}>
            {t("page.undo.set", { time: timeOfDay(set.atMs, 0), count: set.rows.length })}
          </Menu.Item>
        ))}
      </Menu.Dropdown>
    </Menu>
  );
}
