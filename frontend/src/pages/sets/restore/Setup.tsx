import { Button, CloseButton, Select } from "@mantine/core";
import { IconBooks } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { setsQuery } from "../../../api/sets";
import { turbineQuery } from "../../../api/queries";
import type { SetRecord } from "../../../api/types";
import { usePageSearch } from "../../../frame/search";
import { type Translate, useTexts } from "../../../texts/texts";
import { stationName } from "../../../ui/devices";
import { dateAndTime } from "../../../ui/format";
import { GivenName } from "../motors/GivenName";
import { assign, type Assigned, exchange, others } from "./assign";
import { setsIn, useStation } from "./order";
import classes from "./Restore.module.css";

const NONE: SetRecord[] = [];

/** Which station is to have which sets: one for each of its devices, or none. */
export function Setup() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const stations = useQuery(turbineQuery).data?.stations ?? [];
  const records = useQuery(setsQuery).data?.records ?? NONE;
  const sets = setsIn(search.sets);
  const station = useStation();
  const onSets = (next: string[]) =>
    update({ sets: next.length === 0 ? undefined : next.join(","), select: undefined, rows: undefined });
  return (
    <div className={classes.setup}>
      <Select
        label={t("page.restoring.station")}
        placeholder={t("page.restoring.choose_station")}
        data={stations.map((one) => ({ value: one.slug, label: stationName(one, t) }))}
        value={station?.slug ?? null}
        allowDeselect={false}
        w={170}
        onChange={(slug) => update({ station: slug ?? undefined, select: undefined })}
        data-testid="restore-station"
      />
      {station &&
        assign(station.devices, records, sets).map((one) => (
          <SetOf
            key={one.device.slug}
            assigned={one}
            onChange={(to) => onSets(exchange(sets, one.record?.id ?? null, to))}
          />
        ))}
      {others(records, sets).map((key) => (
        <span key={key} className={classes.other}>
          <GivenName given={key} />
          <CloseButton
            aria-label={t("page.restoring.take_out", { set: key })}
            onClick={() => onSets(sets.filter((one) => one !== key))}
          />
        </span>
      ))}
      {sets.length > 0 ? (
        <Button variant="subtle" onClick={() => onSets([])} data-testid="restore-leave">
          {t("page.restoring.to_all")}
        </Button>
      ) : (
        <Button
          variant="default"
          leftSection={<IconBooks size={17} aria-hidden />}
          onClick={() => update({ tab: undefined })}
        >
          {t("page.restoring.to_library")}
        </Button>
      )}
    </div>
  );
}

interface SetOfProps {
  assigned: Assigned;
  onChange: (id: string | null) => void;
}

function SetOf({ assigned: { device, record, choices }, onChange }: SetOfProps) {
  const t = useTexts();
  const turbine = useQuery(turbineQuery).data?.slug;
  const own = choices.filter((one) => one.origin.device === device.slug);
  const items = (list: SetRecord[]) => list.map((one) => ({ value: one.id, label: nameOf(one, turbine, t) }));
  const groups = [
    { group: t("page.restoring.own_sets"), items: items(own) },
    { group: t("page.restoring.other_sets"), items: items(choices.slice(own.length)) },
  ];
  return (
    <Select
      className={classes.chosen ?? ""}
      label={t("page.restoring.change", { device: device.name })}
      placeholder={t(choices.length === 0 ? "page.restoring.no_sets" : "page.restoring.leave")}
      data={groups.filter((one) => one.items.length > 0)}
      value={record?.id ?? null}
      searchable
      clearable
      limit={MOST_SHOWN}
      clearButtonProps={{ "aria-label": t("page.restoring.leave") }}
      onChange={onChange}
      data-testid={`restore-set-${device.slug}`}
    />
  );
}

const MOST_SHOWN = 200;

/** `blade-1 · golden · 2026-11-22 04:31 · before the gearbox`; the turbine where it is another one. */
function nameOf(record: SetRecord, here: string | undefined, t: Translate): string {
  const { device, turbine, reason } = record.origin;
  const station = device.split("/").slice(1, -1).join(" / ");
  const place = turbine === here ? station : `${turbine} / ${station}`;
  const tags = record.tags.map((one) => t(`page.compare.tag.${one.tag}`)).join(", ");
  return [place, tags, dateAndTime(record.t_ns / 1e6), reason].filter(Boolean).join(" · ");
}
