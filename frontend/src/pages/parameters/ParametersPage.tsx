import { Center, Loader } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { sessionQuery, useDescriptionQuery, useTurbineQuery } from "../../api/queries";
import type { DescriptionDoc } from "../../api/types";
import { usePageSearch } from "../../frame/search";
import { Unconnected } from "../../frame/Unconnected";
import { SAID } from "../../model/variant";
import { useCell, useShown, useWatchDevice } from "../../live/live";
import { useTexts } from "../../texts/texts";
import { placesOf, stationName } from "../../ui/devices";
import { ProblemAlert } from "../../ui/ProblemAlert";
import { type Bench, BenchContext, DeviceContextOfTable } from "./context";
import { DevicePicker } from "./DevicePicker";
import { contextOf } from "./devicesOf";
import { Dictionary } from "./Dictionary";
import { useFavourites } from "./favourites";
import classes from "./Parameters.module.css";
import { type Selection, selectionOf } from "./selection";
import { StagedBar, StagedRoom } from "./StagedRoom";

/** Picks the devices of the URL, or the first, and shows their dictionary. */
export function ParametersPage() {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const turbine = useQuery(useTurbineQuery());
  const places = useMemo(() => placesOf(turbine.data), [turbine.data]);
  const selection = useMemo(
    () => selectionOf(places, search.device, search.view),
    [places, search.device, search.view],
  );
  const describe = useDescriptionQuery();
  const description = useQuery({
    ...describe(selection?.kind.descriptionId ?? ""),
    enabled: selection !== null,
  });
  const error = turbine.error ?? description.error;
  return (
    <StagedRoom>
      <div className={classes.page}>
        {selection && (
          <div className={classes.top}>
            <DevicePicker
              places={places}
              selection={selection}
              onPick={(device, side) => update({ device, view: side ? "side" : undefined })}
            />
            <StagedBar />
          </div>
        )}
        {error && <ProblemAlert error={error} title={t("page.table.not_loaded")} />}
        {selection && description.data && <Room selection={selection} doc={description.data} />}
        {turbine.isSuccess && !turbine.data && <Unconnected />}
        {!error && turbine.data !== undefined && !description.data && (
          <Center h="60%">
            <Loader aria-label={t("page.loading")} />
          </Center>
        )}
      </div>
    </StagedRoom>
  );
}

interface RoomProps {
  selection: Selection;
  doc: DescriptionDoc;
}

function Room({ selection, doc }: RoomProps) {
  const t = useTexts();
  const role = useQuery(sessionQuery).data?.role ?? "viewer";
  const { starred, toggleStar } = useFavourites(doc.id);
  const { kind, active, side } = selection;
  const { store, recorded } = useShown();
  const siblings = useMemo(
    () => kind.places.map((place) => contextOf(place, doc, t, store)),
    [kind, doc, t, store],
  );
  const activeSlug = active.device.slug;
  // Defaults and limits follow the variant as soon as the device has said which it is.
  useCell(activeSlug, SAID[0]);
  useCell(activeSlug, SAID[1]);
  const device = siblings.find((one) => one.slug === activeSlug) ?? siblings[0];
  const bench = useMemo<Bench>(
    () => ({
      devices: side ? siblings : siblings.filter((one) => one.slug === activeSlug),
      siblings,
      side,
      store,
      recorded,
      role,
      starred,
      toggleStar,
      nameOf: (slug) => {
        const place = kind.places.find((one) => one.device.slug === slug);
        return place ? stationName(place.station, t) : slug;
      },
    }),
    [siblings, side, activeSlug, store, recorded, role, starred, toggleStar, kind, t],
  );
  if (!device) return null;
  return (
    <BenchContext value={bench}>
      <DeviceContextOfTable value={device}>
        {siblings.map(({ slug }) => (
          <Watch key={slug} slug={slug} />
        ))}
        <Dictionary key={side ? doc.id : activeSlug} />
      </DeviceContextOfTable>
    </BenchContext>
  );
}

/** Keeps the values of one device coming: of all of the kind, as they are compared even where one is shown. */
function Watch({ slug }: { slug: string }) {
  useWatchDevice(slug);
  return null;
}
