import { Alert, Button, Group, Loader, Stack, Text } from "@mantine/core";
import { IconAlertTriangle, IconCircleCheck } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import type { ReactNode } from "react";
import { commands } from "../../api/client";
import type { EntryDoc } from "../../api/types";
import { useDeviceVersion, useStore } from "../../live/live";
import { figure } from "../../model/values";
import { titleOf } from "../../model/rows";
import { useTexts } from "../../texts/texts";
import { useDeviceName } from "../../ui/devices";
import { HoldButton } from "../../ui/HoldButton";
import { ProblemAlert } from "../../ui/ProblemAlert";
import { isStoredUnknown, isUnsaved } from "./cellValue";
import { useDevice } from "./context";
import { Dialog } from "../../ui/Dialog";

interface Props {
  entries: readonly EntryDoc[];
  onClose: () => void;
}

const MOST_NAMES = 6;

export function SaveDialog({ entries, onClose }: Props) {
  return (
    <CommandDialog
      name="save"
      tone="accent"
      run={commands.save}
      onClose={onClose}
      warning={<UnsavedList entries={entries} name="save" />}
    />
  );
}

export function RestartDialog({ entries, onClose }: Props) {
  return (
    <CommandDialog
      name="restart"
      tone="danger"
      run={commands.restart}
      onClose={onClose}
      warning={<UnsavedList entries={entries} name="restart" />}
    />
  );
}

interface CommandProps {
  name: "save" | "restart";
  tone: "accent" | "danger";
  run: (slug: string) => Promise<{ took_s: number }>;
  warning: ReactNode;
  onClose: () => void;
}

/** Says what will happen to which device, and acts only on a held button. */
function CommandDialog({ name, tone, run, warning, onClose }: CommandProps) {
  const t = useTexts();
  const { slug } = useDevice();
  const device = useDeviceName()(slug);
  const command = useMutation({ mutationFn: () => run(slug) });
  const key = (part: string) => `page.${name}.${part}`;
  return (
    <Dialog opened onClose={onClose} title={<Text fw={700}>{t(key("title"), { device })}</Text>} size="lg">
      <Stack gap="md">
        <Text>{t(key("explain"), { device })}</Text>
        {command.isIdle && warning}
        {command.isPending && (
          <Group role="status">
            <Loader size="sm" aria-hidden />
            {t(key("running"), { device })}
          </Group>
        )}
        {command.isSuccess && (
          <Alert
            color="green"
            role="status"
            icon={<IconCircleCheck aria-hidden />}
            data-testid={`${name}-done`}
          >
            {t(key("done"), { device, seconds: figure(command.data.took_s, 1, t.language) })}
          </Alert>
        )}
        {command.isError && <ProblemAlert error={command.error} title={t(key("failed"), { device })} />}
        <Group justify="flex-end">
          <Button variant="default" onClick={onClose} data-autofocus data-testid={`${name}-close`}>
            {t(command.isSuccess ? "page.close" : "page.cancel")}
          </Button>
          {!command.isSuccess && (
            <HoldButton
              tone={tone}
              hint={t("page.hold")}
              disabled={command.isPending}
              onHeld={() => command.mutate()}
              testId={`${name}-hold`}
            >
              {t(key("hold"), { device })}
            </HoldButton>
          )}
        </Group>
      </Stack>
    </Dialog>
  );
}

/** Which values stand in RAM only: a save keeps them, a restart loses them. */
function UnsavedList({ entries, name }: { entries: readonly EntryDoc[]; name: "save" | "restart" }) {
  const t = useTexts();
  const { slug } = useDevice();
  const store = useStore();
  useDeviceVersion(slug);
  const unsaved = entries.filter((entry) => isUnsaved(entry, store.cell(slug, entry.address)));
  const unknown = entries.some((entry) => isStoredUnknown(entry, store.cell(slug, entry.address)));
  if (unsaved.length === 0) {
    return (
      <Text className="dim">{t(unknown ? `page.${name}.stored_unknown` : `page.${name}.no_unsaved`)}</Text>
    );
  }
  const warning = name === "restart";
  return (
    <Alert
      color={warning ? "orange" : "blue"}
      variant="light"
      icon={warning ? <IconAlertTriangle aria-hidden /> : null}
      title={t(`page.${name}.unsaved`, { count: unsaved.length })}
    >
      <ul style={{ margin: 0, paddingLeft: 18 }}>
        {unsaved.slice(0, MOST_NAMES).map((entry) => (
          <li key={entry.address}>
            {entry.address} {titleOf(entry, t)}
          </li>
        ))}
        {unsaved.length > MOST_NAMES && <li>{t("page.more", { count: unsaved.length - MOST_NAMES })}</li>}
      </ul>
    </Alert>
  );
}
