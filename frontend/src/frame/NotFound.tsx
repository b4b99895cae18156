import { Button, Stack, Title } from "@mantine/core";
import { Link } from "@tanstack/react-router";
import { useTexts } from "../texts/texts";

export function NotFound() {
  const t = useTexts();
  return (
    <Stack p="xl" align="flex-start">
      <Title order={2}>{t("page.not_found.title")}</Title>
      <Button component={Link} to="/">
        {t("page.not_found.back")}
      </Button>
    </Stack>
  );
}
