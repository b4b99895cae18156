import { Button } from "@mantine/core";
import { IconPencilCheck, IconTrash } from "@tabler/icons-react";
import type { PdoPreview, Pdos } from "../../../api/pdo";
import { useTexts } from "../../../texts/texts";
import { share } from "./names";
import classes from "./Pdo.module.css";

interface Props {
  pdos: Pdos;
  preview: PdoPreview | undefined;
  changes: number;
  /** The preview is of what is wanted now, and finds no error. */
  ready: boolean;
  locked: boolean;
  onDiscard: () => void;
  onReview: () => void;
}

/** Always in sight: what the bus carries now and would carry, what is changed, and the way on. */
export function PdoBar({ pdos, preview, changes, ready, locked, onDiscard, onReview }: Props) {
  const t = useTexts();
  const cost = changes > 0 ? preview?.cost : undefined;
  const errors = changes > 0 ? (preview?.findings ?? []).filter((one) => one.severity === "error").length : 0;
  return (
    <footer className={classes.bar} data-testid="pdo-bar">
      <div className={classes.loads}>
        <strong data-testid="pdo-load" data-after={cost?.bus_after ?? ""}>
          {cost
            ? t("page.pdo.load_after", { now: share(cost.bus_now, t), after: share(cost.bus_after, t) })
            : t("page.pdo.load_now", { now: share(pdos.bus_load, t) })}
        </strong>
        {cost && (
          <span className="dim">
            {t("page.pdo.load_pdos", { now: share(cost.pdos_now, t), after: share(cost.pdos_after, t) })}
          </span>
        )}
        {cost?.over && (
          <span className="tone-warning" role="alert">
            {t(`page.pdo.load_over_${cost.over}`, { cap: share(cost.cap, t) })}
          </span>
        )}
        <span className="dim">
          {pdos.sync_per_second === null
            ? t("page.pdo.sync_none")
            : t("page.pdo.sync", { rate: pdos.sync_per_second.toLocaleString(t.language) })}
        </span>
      </div>
      <span role="status" data-testid="pdo-changes">
        {changes === 0 ? t("page.pdo.unchanged") : t("page.pdo.changes", { count: changes })}
        {errors > 0 && (
          <b className="tone-error">
            {" · "}
            {errors} × {t("page.pdo.severity.error")}
          </b>
        )}
      </span>
      <Button
        variant="default"
        h={40}
        leftSection={<IconTrash size={17} aria-hidden />}
        disabled={changes === 0}
        onClick={onDiscard}
        data-testid="pdo-discard"
      >
        {t("page.pdo.discard")}
      </Button>
      <Button
        h={40}
        leftSection={<IconPencilCheck size={17} aria-hidden />}
        disabled={changes === 0 || !ready || locked}
        onClick={onReview}
        data-testid="pdo-review"
      >
        {t("page.pdo.review")}
      </Button>
    </footer>
  );
}
