import { Button, Stack, Text, Textarea } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import { queryClient } from "../../../api/queries";
import { giveUp, type RestoreDoc, restoreQuery, restoresQuery } from "../../../api/restore";
import { NeedsRole } from "../../../frame/NeedsRole";
import { useTexts } from "../../../texts/texts";
import { HoldButton } from "../../../ui/HoldButton";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { Dialog } from "../../../ui/Dialog";

interface Props {
  doc: Pick<RestoreDoc, "id">;
  station: string;
}

const LEAST_REASON = 3;

/** The last way out, for an expert who answers for it: the device is gone, and nothing can be finished. */
export function GiveUp({ doc, station }: Props) {
  const t = useTexts();
  const [open, setOpen] = useState(false);
  return (
    <>
      <NeedsRole role="expert">
        {(locked) => (
          <Button
            variant="subtle"
            color="gray"
            disabled={locked}
            onClick={() => setOpen(true)}
            data-testid="give-up-open"
          >
            {t("page.restoring.give_up.open")}
          </Button>
        )}
      </NeedsRole>
      {open && <GiveUpDialog doc={doc} station={station} onClose={() => setOpen(false)} />}
    </>
  );
}

function GiveUpDialog({ doc, station, onClose }: Props & { onClose: () => void }) {
  const t = useTexts();
  const [reason, setReason] = useState("");
  const order = useMutation({
    mutationFn: () => giveUp(doc.id, reason.trim()),
    onSuccess: (found) => {
      queryClient.setQueryData(restoreQuery(doc.id).queryKey, found);
      void queryClient.invalidateQueries({ queryKey: restoresQuery.queryKey });
      onClose();
    },
  });
  return (
    <Dialog
      opened
      onClose={onClose}
      title={<Text fw={700}>{t("page.restoring.give_up.title", { station })}</Text>}
      size="lg"
    >
      <Stack gap="md" align="flex-start">
        <Text>{t("page.restoring.give_up.explain", { station })}</Text>
        <Textarea
          label={t("page.restoring.give_up.reason")}
          value={reason}
          onChange={(event) => setReason(event.currentTarget.value)}
          maxLength={500}
          autosize
          minRows={2}
          w="100%"
          required
          data-autofocus
          data-testid="give-up-reason"
        />
        {order.error && <ProblemAlert error={order.error} title={t("page.restoring.way_failed.give-up")} />}
        <HoldButton
          tone="danger"
          hint={t("page.hold")}
          disabled={reason.trim().length < LEAST_REASON || order.isPending}
          onHeld={() => order.mutate()}
          testId="give-up-hold"
        >
          {t("page.restoring.give_up.button")}
        </HoldButton>
      </Stack>
    </Dialog>
  );
}
