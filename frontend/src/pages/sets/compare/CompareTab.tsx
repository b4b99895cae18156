import { useTexts } from "../../../texts/texts";
import room from "../../../ui/Room.module.css";

export function CompareTab() {
  const t = useTexts();
  return (
    <div className={room.room}>
      <div className={room.strip}>
        <h1>{t("page.sets.tab.compare")}</h1>
      </div>
      <p className={room.note}>{t("page.sets.empty.compare")}</p>
    </div>
  );
}
