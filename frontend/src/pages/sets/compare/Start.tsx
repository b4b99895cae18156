import { Button } from "@mantine/core";
import { IconArrowsDiff, IconColumns3 } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { turbineQuery } from "../../../api/queries";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { placesOf, stationName } from "../../../ui/devices";
import { kindsOf } from "../../parameters/selection";
import classes from "./Compare.module.css";
import { ofDevice, Source } from "./specs";

/** What a technician asks for first. */
const FIRST = [
  Source.Left,
  Source.Found,
  Source.Delivered,
  Source.Golden,
  Source.Stored,
  Source.Default,
] as const;

interface Props {
  columns: readonly string[];
  onColumns: (columns: string[]) => void;
}

/** Nothing is compared yet: the comparisons that are wanted most, one press away. */
export function Start({ columns, onColumns }: Props) {
  const t = useTexts();
  const [search] = usePageSearch();
  const places = placesOf(useQuery(turbineQuery).data ?? undefined);
  const place = places.find((one) => one.device.slug === search.device) ?? places[0];
  return (
    <div className={classes.start}>
      <p>{t(columns.length === 0 ? "page.compare.start.none" : "page.compare.start.one")}</p>
      {place && (
        <>
          <h2>
            {t("page.compare.start.now_against", {
              device: `${stationName(place.station, t)} ${place.device.name}`,
            })}
          </h2>
          <div className={classes.ways}>
            {FIRST.map((source) => (
              <Button
                key={source}
                variant="default"
                leftSection={<IconArrowsDiff size={17} aria-hidden />}
                title={t(`page.compare.hint.${source}`)}
                onClick={() =>
                  onColumns([ofDevice(source, place.device.slug), ofDevice(Source.Live, place.device.slug)])
                }
                data-testid={`start-${source}`}
              >
                {t(`page.compare.source.${source}`)}
              </Button>
            ))}
          </div>
          <h2>{t("page.compare.start.blades")}</h2>
          <div className={classes.ways}>
            {kindsOf(places)
              .filter((kind) => kind.places.length > 1)
              .map((kind) => (
                <Button
                  key={kind.descriptionId}
                  variant="default"
                  leftSection={<IconColumns3 size={17} aria-hidden />}
                  onClick={() => onColumns(kind.places.map((one) => ofDevice(Source.Live, one.device.slug)))}
                  data-testid={`start-${kind.descriptionId}`}
                >
                  {kind.name}
                </Button>
              ))}
          </div>
        </>
      )}
    </div>
  );
}
