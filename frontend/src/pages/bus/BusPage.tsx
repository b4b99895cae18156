import { useTexts } from "../../texts/texts";

export function BusPage() {
  const t = useTexts();
  return <h1>{t("page.rooms.bus")}</h1>;
}
