import { Button } from "@mantine/core";
import type { ReactNode } from "react";
import { useTexts } from "../texts/texts";
import { Dialog } from "../ui/Dialog";
import { ProblemAlert } from "../ui/ProblemAlert";
import classes from "./MarkMoment.module.css";

interface Props {
  title: string;
  /** Of the form, `<name>-form`, and of the button that keeps it, `<name>-keep`. */
  name: string;
  /** What the button says. */
  keep: string;
  /** All that is needed is given. */
  ready: boolean;
  keeping: { mutate: () => void; isPending: boolean; error: Error | null };
  onClose: () => void;
  children: ReactNode;
}

/** The dialog in which something is written down of a recording; where it cannot be kept it stays open and says why. */
export function MarkMomentFrame({ title, name, keep, ready, keeping, onClose, children }: Props) {
  const t = useTexts();
  return (
    <Dialog opened onClose={onClose} title={title} size="lg">
      <form
        className={classes.form}
        onSubmit={(event) => {
          event.preventDefault();
          keeping.mutate();
        }}
        data-testid={`${name}-form`}
      >
        {children}
        {keeping.error && <ProblemAlert error={keeping.error} title={t("page.mark.failed")} />}
        <div className={classes.buttons}>
          <Button variant="default" onClick={onClose}>
            {t("page.cancel")}
          </Button>
          <Button type="submit" disabled={!ready} loading={keeping.isPending} data-testid={`${name}-keep`}>
            {keep}
          </Button>
        </div>
      </form>
    </Dialog>
  );
}
