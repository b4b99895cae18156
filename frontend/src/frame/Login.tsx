import {
  Alert,
  Button,
  Center,
  Group,
  Paper,
  PasswordInput,
  Stack,
  Text,
  TextInput,
  Title,
} from "@mantine/core";
import { IconAlertTriangle, IconLanguage, IconLogin2 } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { type SyntheticEvent, useEffect, useState } from "react";
import { Problem } from "../api/client";
import { startAfresh, signing } from "../api/settings";
import type { Translate } from "../texts/texts";
import { usePageSearch } from "./search";

const SECOND_MS = 1000;

/** Name and password. Its texts come with the page: before the login the server need not give any. */
export function Login({ t }: { t: Translate }) {
  const [name, setName] = useState("");
  const [password, setPassword] = useState("");
  const [waitS, setWaitS] = useState(0);
  const login = useMutation({
    mutationFn: () => signing.in(name.trim(), password),
    onSuccess: startAfresh,
    onError: (error) => {
      setPassword("");
      setWaitS(pauseOf(error));
    },
  });
  useCountdown(waitS, setWaitS);
  const submit = (event: SyntheticEvent) => {
    event.preventDefault();
    if (name.trim() !== "" && password !== "" && waitS === 0 && !login.isPending) login.mutate();
  };
  return (
    <Center h="100%" p="md" component="main">
      <Paper p="xl" radius="md" withBorder w={400} maw="100%">
        <form onSubmit={submit} data-testid="login">
          <Stack gap="md">
            <Group justify="space-between" wrap="nowrap">
              <Title order={2}>{t("page.boot.login_title")}</Title>
              <LanguageSwitch t={t} />
            </Group>
            <Text c="dimmed" size="sm">
              {t("page.boot.login_explain")}
            </Text>
            <TextInput
              label={t("page.boot.login_name")}
              value={name}
              autoComplete="username"
              autoFocus
              onChange={(event) => setName(event.currentTarget.value)}
              data-testid="login-name"
            />
            <PasswordInput
              label={t("page.boot.login_password")}
              value={password}
              autoComplete="current-password"
              visibilityToggleButtonProps={{ "aria-label": t("page.boot.login_show") }}
              onChange={(event) => setPassword(event.currentTarget.value)}
              data-testid="login-password"
            />
            {(login.isError || waitS > 0) && (
              <Alert color="red" variant="light" icon={<IconAlertTriangle aria-hidden />} role="alert">
                <span data-testid="login-error">{reasonOf(login.error, waitS, t)}</span>
              </Alert>
            )}
            <Button
              type="submit"
              loading={login.isPending}
              disabled={waitS > 0 || name.trim() === "" || password === ""}
              leftSection={<IconLogin2 size={18} aria-hidden />}
              data-testid="login-submit"
            >
              {waitS > 0 ? t("page.boot.login_wait", { seconds: waitS }) : t("page.boot.login_button")}
            </Button>
          </Stack>
        </form>
      </Paper>
    </Center>
  );
}

function LanguageSwitch({ t }: { t: Translate }) {
  const [, update] = usePageSearch();
  const other = t.language === "en" ? "de" : "en";
  return (
    <Button
      variant="default"
      px="sm"
      leftSection={<IconLanguage size={18} aria-hidden />}
      aria-label={t("page.boot.login_language")}
      onClick={() => update({ lang: other })}
      data-testid="login-language"
    >
      {other.toUpperCase()}
    </Button>
  );
}

/** Seconds that the server wants to be left alone after failed attempts. */
function pauseOf(error: unknown): number {
  if (!(error instanceof Problem)) return 0;
  const wanted = error.doc.details.retry_after_s;
  return typeof wanted === "number" ? Math.ceil(wanted) : 0;
}

function useCountdown(leftS: number, set: (leftS: number) => void): void {
  useEffect(() => {
    if (leftS <= 0) return;
    const timer = setTimeout(() => set(leftS - 1), SECOND_MS);
    return () => clearTimeout(timer);
  }, [leftS, set]);
}

function reasonOf(error: unknown, waitS: number, t: Translate): string {
  if (!(error instanceof Problem)) return t("page.boot.unreachable_text");
  if (error.doc.code === "login_paused" && waitS > 0) return t("page.boot.login_paused");
  if (error.doc.code === "login" || error.doc.code === "login_paused") return t("page.boot.login_wrong");
  return t("page.boot.login_failed", { status: error.doc.status });
}
