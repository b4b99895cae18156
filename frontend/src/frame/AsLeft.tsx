import { Alert, Button, Text } from "@mantine/core";
import { IconDatabase, IconRefresh } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { commands, get } from "../api/client";
import { queryClient } from "../api/queries";
import { type LeftNow, leftQuery } from "../api/sets";
import type { Job } from "../api/types";
import { useTexts } from "../texts/texts";
import { ProblemAlert } from "../ui/ProblemAlert";
import { NeedsRole } from "./NeedsRole";

const LOOK_MS = 300;

/** Before leaving: the values as left are kept; where some are not known, everything can be read first. */
export function AsLeft() {
  const t = useTexts();
  const left = useQuery(leftQuery);
  const reading = useMutation({
    mutationFn: (devices: readonly LeftNow[]) => Promise.all(devices.map((one) => readAll(one.device))),
    onSettled: () => queryClient.invalidateQueries({ queryKey: leftQuery.queryKey }),
  });
  if (!left.data) return null;
  const open = left.data.filter((one) => one.unread + one.stale > 0);
  const sum = (count: (one: LeftNow) => number) => left.data.reduce((total, one) => total + count(one), 0);
  const missing = sum((one) => one.unread + one.stale);
  return (
    <Alert
      color={missing === 0 ? "blue" : "yellow"}
      variant="light"
      title={t("page.visit.left.title")}
      icon={<IconDatabase aria-hidden />}
      data-testid="as-left"
    >
      <Text size="sm">
        {t("page.visit.left.kept", {
          count: sum((one) => one.parameters) - missing,
          devices: left.data.length,
        })}{" "}
        {missing > 0 &&
          t("page.visit.left.missing", { unread: sum((one) => one.unread), stale: sum((one) => one.stale) })}
      </Text>
      {reading.isError && <ProblemAlert error={reading.error} title={t("page.visit.left.failed")} />}
      {missing > 0 && (
        <NeedsRole role="technician">
          {(locked) => (
            <Button
              mt={8}
              variant="default"
              disabled={locked}
              loading={reading.isPending}
              leftSection={<IconRefresh size={17} aria-hidden />}
              onClick={() => reading.mutate(open)}
              data-testid="read-before-leaving"
            >
              {t("page.visit.left.read")}
            </Button>
          )}
        </NeedsRole>
      )}
    </Alert>
  );
}

/** Reads a device completely; ends when its job does. */
async function readAll(slug: string): Promise<void> {
  const { id } = await commands.read(slug, null);
  for (;;) {
    const job = await get<Job>(`/api/live/jobs/${id}`);
    if (job.state !== "running") return;
    await new Promise((resolve) => setTimeout(resolve, LOOK_MS));
  }
}
