import { Alert, Button, Text } from "@mantine/core";
import { IconDatabase, IconRefresh } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { commands, get } from "../api/client";
import { queryClient } from "../api/queries";
import { type LeftNow, leftQuery } from "../api/sets";
import type { Job } from "../api/types";
import { useServerNow } from "../live/live";
import { type Translate, useTexts } from "../texts/texts";
import { useDeviceName } from "../ui/devices";
import { age } from "../ui/format";
import { ProblemAlert } from "../ui/ProblemAlert";
import classes from "./AsLeft.module.css";
import { NeedsRole } from "./NeedsRole";

const LOOK_MS = 300;
const TICK_MS = 1000;

/** Before leaving: what is kept of each device as left and how old that is; everything can be read once more. */
export function AsLeft() {
  const t = useTexts();
  const left = useQuery(leftQuery);
  const reading = useMutation({
    mutationFn: (devices: readonly LeftNow[]) => Promise.all(devices.map((one) => readAll(one.device))),
    onSettled: () => queryClient.invalidateQueries({ queryKey: leftQuery.queryKey }),
  });
  if (!left.data) return null;
  const sum = (count: (one: LeftNow) => number) => left.data.reduce((total, one) => total + count(one), 0);
  const missing = sum(missingOf);
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
      <Ages devices={left.data} />
      {reading.isError && <ProblemAlert error={reading.error} title={t("page.visit.left.failed")} />}
      <NeedsRole role="technician" device>
        {(locked) => (
          <Button
            mt={8}
            variant={missing > 0 ? "filled" : "default"}
            disabled={locked}
            loading={reading.isPending}
            leftSection={<IconRefresh size={17} aria-hidden />}
            onClick={() => reading.mutate(left.data)}
            data-testid="read-before-leaving"
          >
            {t("page.visit.left.read")}
          </Button>
        )}
      </NeedsRole>
    </Alert>
  );
}

/** Of each device: when it was read completely, what was written since, and what is missing. */
function Ages({ devices }: { devices: readonly LeftNow[] }) {
  const t = useTexts();
  const nameOf = useDeviceName();
  const nowMs = useServerNow(TICK_MS);
  return (
    <ul className={classes.ages}>
      {devices.map((one) => (
        <li key={one.device} data-missing={missingOf(one) > 0} data-testid={`left-${one.device}`}>
          <strong>{nameOf(one.device)}</strong> {toldOf(one, nowMs, t)}
        </li>
      ))}
    </ul>
  );
}

const missingOf = (one: LeftNow): number => one.unread + one.stale;

function toldOf(one: LeftNow, nowMs: number, t: Translate): string {
  const missing = missingOf(one) > 0 ? [t("page.visit.left.unknown", { count: missingOf(one) })] : [];
  if (one.read_ns === null) return [...missing, t("page.visit.left.never")].join(", ");
  const writes = one.writes === 0 ? "none" : one.writes === 1 ? "one" : "many";
  return [
    ...missing,
    t("page.visit.left.age", { age: age(nowMs - one.read_ns / 1e6, t.language) }),
    t(`page.visit.left.writes.${writes}`, { count: one.writes }),
  ].join(", ");
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
