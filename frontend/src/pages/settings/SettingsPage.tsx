import { useTexts } from "../../texts/texts";

export function SettingsPage() {
  const t = useTexts();
  return <h1>{t("page.rooms.settings")}</h1>;
}
