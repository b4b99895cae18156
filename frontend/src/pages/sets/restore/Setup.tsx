import { Button, Select } from "@mantine/core";
import { IconArrowLeft, IconBooks } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { turbineQuery } from "../../../api/queries";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { stationName } from "../../../ui/devices";
import { setsIn } from "./order";
import classes from "./Restore.module.css";

/** Which station is to have which sets. */
export function Setup() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const stations = useQuery(turbineQuery).data?.stations ?? [];
  const sets = setsIn(search.sets);
  return (
    <div className={classes.setup}>
      <Select
        label={t("page.restoring.station")}
        placeholder={t("page.restoring.choose_station")}
        data={stations.map((one) => ({ value: one.slug, label: stationName(one, t) }))}
        value={search.station ?? null}
        allowDeselect={false}
        onChange={(slug) => update({ station: slug ?? undefined, select: undefined })}
        data-testid="restore-station"
      />
      {sets.length === 0 ? (
        <Button
          variant="default"
          leftSection={<IconBooks size={17} aria-hidden />}
          onClick={() => update({ tab: undefined })}
        >
          {t("page.restoring.to_library")}
        </Button>
      ) : (
        <Button
          variant="subtle"
          leftSection={<IconArrowLeft size={17} aria-hidden />}
          onClick={() => update({ sets: undefined, select: undefined, rows: undefined })}
          data-testid="restore-leave"
        >
          {t("page.restoring.to_all")}
        </Button>
      )}
    </div>
  );
}
