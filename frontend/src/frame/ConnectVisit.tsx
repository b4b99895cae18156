import { Button, Group, Loader, Stack, Text, Textarea, TextInput } from "@mantine/core";
import { IconDoorExit } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { queryClient, turbineQuery } from "../api/queries";
import { AsLeft } from "./AsLeft";
import { connecting, knownTurbinesQuery, visitQuery, type Visit } from "../api/settings";
import { useTexts } from "../texts/texts";
import { notify } from "../ui/notices";
import { ProblemAlert } from "../ui/ProblemAlert";
import { age } from "../ui/format";
import { useServerNow } from "../live/live";
import { Dialog } from "../ui/Dialog";

const MINUTE_MS = 60_000;
const LONGEST = { reason: 2000, order: 100 };

/** What the visit was for, and its end: the values as left are kept, and the connection ends. */
export function EndVisit({ onClose }: { onClose: () => void }) {
  const t = useTexts();
  const present = useQuery(visitQuery);
  const visit = present.data?.visit;
  return (
    <Dialog opened onClose={onClose} title={t("page.visit.title")} size="lg">
      {present.isError && <ProblemAlert error={present.error} title={t("page.visit.failed")} />}
      {present.isPending && <Loader aria-label={t("page.loading")} />}
      {visit === null && <Text>{t("page.visit.none")}</Text>}
      {visit && <Form key={visit.id} visit={visit} onClose={onClose} />}
    </Dialog>
  );
}

function Form({ visit, onClose }: { visit: Visit; onClose: () => void }) {
  const t = useTexts();
  const nowMs = useServerNow(MINUTE_MS);
  const [reason, setReason] = useState(visit.reason);
  const [order, setOrder] = useState(visit.work_order);
  const ending = useMutation({
    mutationFn: () => connecting.endVisit(reason, order),
    onSuccess: async () => {
      notify({ tone: "ok", title: t("page.visit.ended", { turbine: visit.turbine }), lines: [] });
      onClose();
      await queryClient.invalidateQueries({ queryKey: turbineQuery.queryKey });
      await queryClient.invalidateQueries({ queryKey: knownTurbinesQuery.queryKey });
    },
  });
  const keeping = useMutation({
    mutationFn: () => connecting.changeVisit(reason, order),
    onSuccess: onClose,
  });
  const busy = ending.isPending || keeping.isPending;
  const error = ending.error ?? keeping.error;
  return (
    <Stack>
      <Text size="sm">
        {t("page.visit.explain", {
          turbine: visit.turbine,
          person: visit.person,
          age: age(nowMs - visit.started_ns / 1e6, t.language),
        })}
      </Text>
      <Textarea
        label={t("page.visit.reason")}
        autosize
        minRows={2}
        maxLength={LONGEST.reason}
        value={reason}
        onChange={(event) => setReason(event.currentTarget.value)}
        data-testid="visit-reason"
      />
      <TextInput
        label={t("page.visit.order")}
        maxLength={LONGEST.order}
        value={order}
        onChange={(event) => setOrder(event.currentTarget.value)}
        data-testid="visit-order"
      />
      <AsLeft />
      {error !== null && <ProblemAlert error={error} title={t("page.visit.not_ended")} />}
      <Group justify="flex-end">
        <Button variant="default" disabled={busy} onClick={() => keeping.mutate()}>
          {t("page.visit.keep")}
        </Button>
        <Button
          leftSection={<IconDoorExit size={18} aria-hidden />}
          loading={ending.isPending}
          disabled={busy}
          onClick={() => ending.mutate()}
          data-testid="end-visit"
        >
          {t("page.visit.end")}
        </Button>
      </Group>
    </Stack>
  );
}
