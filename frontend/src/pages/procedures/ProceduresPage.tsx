import { useTexts } from "../../texts/texts";

export function ProceduresPage() {
  const t = useTexts();
  return <h1>{t("page.rooms.procedures")}</h1>;
}
