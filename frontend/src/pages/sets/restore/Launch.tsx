import { Checkbox, Select, TextInput } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import { queryClient } from "../../../api/queries";
import { type PlanRequest, restoreQuery, restoresQuery, startRestore } from "../../../api/restore";
import { NeedsRole } from "../../../frame/NeedsRole";
import { usePageSearch } from "../../../frame/search";
import { useHearing } from "../../../live/live";
import { useTexts } from "../../../texts/texts";
import { HoldButton } from "../../../ui/HoldButton";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import type { Planned, Terms } from "./order";
import { isPicked } from "./plan";
import classes from "./Restore.module.css";

const MAX_REASON = 500;
const MAX_WORK_ORDER = 100;
const MINUTES = ["1", "2", "5", "10", "15"];
const MINUTE_S = 60;

interface Props {
  planned: Planned;
  order: PlanRequest;
  station: string;
  terms: Terms;
  onTerms: (terms: Terms) => void;
  confirmMin: number;
  onConfirmMin: (minutes: number) => void;
}

/** Reason, work order and how long there is to confirm; held down, the restore begins. */
export function Launch({ planned, order, station, terms, onTerms, confirmMin, onConfirmMin }: Props) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const hearing = useHearing().state === "hearing";
  const [reason, setReason] = useState("");
  const [workOrder, setWorkOrder] = useState("");
  const { plan, lines, outdated } = planned;
  const start = useMutation({
    mutationFn: startRestore,
    onSuccess: (doc) => {
      queryClient.setQueryData(restoreQuery(doc.id).queryKey, doc);
      void queryClient.invalidateQueries({ queryKey: restoresQuery.queryKey });
      update({ restore: doc.id, rows: undefined });
    },
    // What stands in the devices is not what was looked at any more, or something speaks against it now.
    onError: () => planned.readAgain(),
  });
  const able = hearing && plan !== undefined && !outdated && plan.refusals.length === 0 && !start.isPending;
  const count = lines.filter(isPicked).length;
  return (
    <div className={classes.launch}>
      {start.isError && <ProblemAlert error={start.error} title={t("page.restoring.not_begun")} />}
      <div className={classes.pair}>
        <TextInput
          aria-label={t("page.restoring.work_order")}
          placeholder={t("page.restoring.work_order")}
          value={workOrder}
          maxLength={MAX_WORK_ORDER}
          onChange={(event) => setWorkOrder(event.currentTarget.value)}
          data-testid="work-order"
        />
        <Select
          aria-label={t("page.restoring.confirm_within")}
          data={MINUTES.map((value) => ({ value, label: t("page.restoring.minutes", { count: value }) }))}
          value={String(confirmMin)}
          allowDeselect={false}
          onChange={(value) => onConfirmMin(Number(value))}
          data-testid="confirm-within"
        />
      </div>
      <TextInput
        aria-label={t("page.restoring.reason")}
        placeholder={t("page.restoring.reason")}
        value={reason}
        maxLength={MAX_REASON}
        onChange={(event) => setReason(event.currentTarget.value)}
        data-testid="restore-reason"
      />
      <Checkbox
        label={t(`page.restoring.restart${plan?.by_hand.length ? "_hand" : ""}`)}
        checked={terms.restart}
        onChange={(event) => onTerms({ ...terms, restart: event.currentTarget.checked })}
        data-testid="restore-restart"
      />
      <NeedsRole role="technician" device>
        {(locked) => (
          <HoldButton
            tone="accent"
            hint={t("page.hold")}
            disabled={locked || !able}
            onHeld={() => {
              if (!plan) return;
              start.mutate({
                ...order,
                plan_hash: plan.hash,
                reason: reason.trim(),
                work_order: workOrder.trim(),
                confirm_s: confirmMin * MINUTE_S,
              });
            }}
            testId="restore-hold"
          >
            {t(`page.restoring.start${count === 1 ? "_one" : ""}`, { count, station })}
          </HoldButton>
        )}
      </NeedsRole>
    </div>
  );
}
