import type { RestoreDoc } from "../../../api/restore";
import { NeedsRole } from "../../../frame/NeedsRole";
import { useTexts } from "../../../texts/texts";
import { HoldButton } from "../../../ui/HoldButton";
import classes from "./Restore.module.css";
import { useWay } from "./ways";

interface Props {
  doc: Pick<RestoreDoc, "id">;
  /** The way on to the new values; back to the old ones is always the other. */
  onward: "resume" | "confirm";
  label: string;
  disabled?: boolean;
}

/** Old values or new ones: held, not clicked. */
export function Decision({ doc, onward, label, disabled = false }: Props) {
  const t = useTexts();
  const way = useWay(doc);
  return (
    <NeedsRole role="technician" device>
      {(locked) => (
        <div className={classes.buttons}>
          <HoldButton
            tone="danger"
            hint={t("page.hold")}
            disabled={locked || way.isPending}
            onHeld={() => way.mutate("roll-back")}
            testId="roll-back-hold"
          >
            {t("page.restoring.roll_back")}
          </HoldButton>
          <HoldButton
            tone="accent"
            hint={t("page.hold")}
            disabled={locked || way.isPending || disabled}
            onHeld={() => way.mutate(onward)}
            testId={`${onward}-hold`}
          >
            {label}
          </HoldButton>
        </div>
      )}
    </NeedsRole>
  );
}

/** On to the new values or back to the old ones: one of the two must be done before anything moves again. */
export function WaysOut({ doc }: { doc: Pick<RestoreDoc, "id"> }) {
  const t = useTexts();
  return <Decision doc={doc} onward="resume" label={t("page.restoring.resume")} />;
}
