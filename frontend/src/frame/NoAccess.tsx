import { Center, Paper, Stack, Text, Title } from "@mantine/core";
import { IconKey, IconPlugOff } from "@tabler/icons-react";
import type { Translate } from "../texts/texts";

/** Shown instead of the page where there is no access, or no server. Both say what to do next. */
export function NoAccess({ t, unreachable = false }: { t: Translate; unreachable?: boolean }) {
  const about = unreachable ? "unreachable" : "no_access";
  const Icon = unreachable ? IconPlugOff : IconKey;
  return (
    <Center h="100%" p="md" component="main">
      <Paper p="xl" radius="md" withBorder maw={560} role="alert">
        <Stack gap="sm">
          <Icon size={36} aria-hidden />
          <Title order={2}>{t(`page.boot.${about}_title`)}</Title>
          <Text>{t(`page.boot.${about}_text`)}</Text>
        </Stack>
      </Paper>
    </Center>
  );
}
