import { Alert, Button, Group, Loader, ScrollArea, Stack, Table, Text } from "@mantine/core";
import { IconAlertTriangle, IconCircleCheck } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { commands } from "../../api/client";
import type { VerifyResult } from "../../api/types";
import { titleOf } from "../../model/rows";
import { useTexts } from "../../texts/texts";
import { useDeviceName } from "../../ui/devices";
import { Dialog } from "../../ui/Dialog";
import { ProblemAlert } from "../../ui/ProblemAlert";
import { entriesOf } from "../../ui/reading";
import { useDevice } from "./context";

/** What the device has otherwise than its description says: the whole dictionary is read for it, anew each time. */
export function VerifyDialog({ onClose }: { onClose: () => void }) {
  const t = useTexts();
  const { slug } = useDevice();
  const device = useDeviceName()(slug);
  const result = useQuery({
    queryKey: ["verify", slug],
    queryFn: () => commands.verify(slug),
    gcTime: 0,
    staleTime: Infinity,
    retry: false,
  });
  return (
    <Dialog
      opened
      onClose={onClose}
      size={760}
      title={<Text fw={700}>{t("page.device_check.title", { device })}</Text>}
      data-testid="verify-dialog"
    >
      <Stack gap="md">
        {result.isPending && (
          <Group role="status">
            <Loader size="sm" aria-hidden />
            {t("page.device_check.running", { device })}
          </Group>
        )}
        {result.isError && (
          <ProblemAlert error={result.error} title={t("page.device_check.failed", { device })} />
        )}
        {result.data && <Findings result={result.data} />}
        <Group justify="flex-end">
          <Button variant="default" onClick={onClose} data-autofocus>
            {t("page.close")}
          </Button>
        </Group>
      </Stack>
    </Dialog>
  );
}

const MOST_HEIGHT = 360;

function Findings({ result: { objects, findings } }: { result: VerifyResult }) {
  const t = useTexts();
  const { doc } = useDevice();
  if (findings.length === 0) {
    return (
      <Alert color="green" role="status" icon={<IconCircleCheck aria-hidden />} data-testid="verify-none">
        {t("page.device_check.none", { objects })}
      </Alert>
    );
  }
  const nameOf = (address: string) => {
    const entry = entriesOf(doc).get(address);
    return entry ? titleOf(entry, t) : "";
  };
  return (
    <>
      <Alert color="orange" role="status" icon={<IconAlertTriangle aria-hidden />} data-testid="verify-some">
        {t("page.device_check.some", { count: findings.length, objects })}
      </Alert>
      <ScrollArea.Autosize mah={MOST_HEIGHT}>
        <Table stickyHeader>
          <Table.Thead>
            <Table.Tr>
              <Table.Th>{t("page.device_check.column_object")}</Table.Th>
              <Table.Th>{t("page.device_check.column_how")}</Table.Th>
              <Table.Th>{t("page.device_check.column_expected")}</Table.Th>
              <Table.Th>{t("page.device_check.column_found")}</Table.Th>
            </Table.Tr>
          </Table.Thead>
          <Table.Tbody>
            {findings.map((one) => (
              <Table.Tr key={`${one.address} ${one.deviation}`} data-testid={`verify-${one.address}`}>
                <Table.Td>
                  {one.address} {nameOf(one.address)}
                </Table.Td>
                <Table.Td>{t(`page.device_check.deviation.${one.deviation}`)}</Table.Td>
                <Table.Td>{one.expected ?? "–"}</Table.Td>
                <Table.Td>{one.found ?? "–"}</Table.Td>
              </Table.Tr>
            ))}
          </Table.Tbody>
        </Table>
      </ScrollArea.Autosize>
    </>
  );
}
