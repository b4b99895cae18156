import { useTexts } from "../../texts/texts";

export function RecordingsPage() {
  const t = useTexts();
  return <h1>{t("page.rooms.recordings")}</h1>;
}
