/** The choices of the picker, from the connected turbine and the library. */
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { MOST_RECORDS, recordsQuery } from "../../../api/compare";
import type { SetRecord } from "../../../api/types";
import { turbineQuery } from "../../../api/queries";
import { useServerNow } from "../../../live/live";
import { type Translate, useTexts } from "../../../texts/texts";
import { placesOf, stationName } from "../../../ui/devices";
import { dateAndTime } from "../../../ui/format";
import { type Choice, choice, deviceChoices, keptOf } from "./choices";
import { deviceOf, ofDevice, Source } from "./specs";
import { turbineOf, usePlaceName } from "./titles";

const HOUR_MS = 3_600_000;

/** `kind`: only devices and sets of this description; all where it is null. `reference`: the first column. */
export function useChoices(kind: string | null, reference: string | null): Choice[] {
  const t = useTexts();
  const nameOf = usePlaceName();
  const turbine = useQuery(turbineQuery).data;
  const records = useQuery(recordsQuery(kind)).data;
  const nowMs = useServerNow(HOUR_MS);
  return useMemo(() => {
    const devices = placesOf(turbine)
      .map(({ station, device }) => ({
        slug: device.slug,
        name: `${stationName(station, t)} ${device.name}`,
        descriptionId: device.description_id,
      }))
      .filter((one) => kind === null || one.descriptionId === kind);
    // Only a list that is whole tells what there is not.
    const whole = records !== undefined && records.length < MOST_RECORDS;
    const kept = whole ? keptOf(records, nowMs) : null;
    const words = {
      source: (source: Source) => t(`page.compare.source.${source}`),
      hint: (source: Source) => t(`page.compare.hint.${source}`),
      none: t("page.compare.picker.not_kept"),
    };
    const of = reference === null ? null : deviceOf(reference);
    return [
      ...deviceChoices(devices, of, kept, words),
      ...(records ?? []).map((record) => recordChoice(record, nameOf, t)),
    ];
  }, [turbine, records, kind, reference, nowMs, nameOf, t]);
}

function recordChoice(record: SetRecord, nameOf: (slug: string) => string, t: Translate): Choice {
  const { device, person, reason, work_order } = record.origin;
  const label = `${turbineOf(device)} ${nameOf(device)} · ${dateAndTime(record.t_ns / 1e6)}`;
  const tags = record.tags.map((one) => t(`page.compare.tag.${one.tag}`));
  const hint = [...tags, reason, work_order, person, record.hash.slice(0, 8)].filter(Boolean).join(" · ");
  return choice(ofDevice(Source.Set, record.id), label, hint, t("page.sets.tab.library"));
}
