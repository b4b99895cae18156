import { useTexts } from "../../texts/texts";

export function AxisPage() {
  const t = useTexts();
  return <h1>{t("page.rooms.axis")}</h1>;
}
