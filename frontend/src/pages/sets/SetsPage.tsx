import { useTexts } from "../../texts/texts";

export function SetsPage() {
  const t = useTexts();
  return <h1>{t("page.rooms.sets")}</h1>;
}
