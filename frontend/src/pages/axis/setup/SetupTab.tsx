import { SegmentedControl } from "@mantine/core";
import { type ComponentType, lazy, Suspense } from "react";
import type { StationRef } from "../../../api/types";
import { usePageSearch } from "../../../frame/search";
import { useWatchDevice } from "../../../live/live";
import type { DeviceContext } from "../../../model/shown";
import { useTexts } from "../../../texts/texts";
import { useDeviceContext } from "../../../ui/reading";
import classes from "../Axis.module.css";
import { BladeStrip } from "../BladeStrip";
import room from "../../../ui/Room.module.css";
import { PMC, PMM } from "../../overview/layout";
import { StagedBar, StagedRoom } from "../../parameters/StagedRoom";

/** What a picture is drawn of: the two units of a blade, as far as the station has them. */
export interface PictureProps {
  station: StationRef;
  pmm: DeviceContext | null;
  pmc: DeviceContext | null;
}

/** Each comes when it is looked at; the first one needs no mention in the address. */
const PICTURES: Readonly<Record<string, ComponentType<PictureProps>>> = {
  temperatures: lazy(async () => ({ default: (await import("./temperatures/Temperatures")).Temperatures })),
  masks: lazy(async () => ({ default: (await import("./masks/Masks")).Masks })),
  ladder: lazy(async () => ({ default: (await import("./ladder/Ladder")).Ladder })),
  battery: lazy(async () => ({ default: (await import("./battery/BatteryPicture")).BatteryPicture })),
  gear: lazy(async () => ({ default: (await import("./gear/GearPicture")).GearPicture })),
  controller: lazy(async () => ({ default: (await import("./ControllerPicture")).ControllerPicture })),
};

/** The pictures that set up an axis; what is changed in one is staged, and written from the review of all changes. */
export function SetupTab() {
  return (
    <StagedRoom>
      <div className={classes.page}>
        <BladeStrip now={() => <Choice />}>
          {(station) => <Picture key={station.slug} station={station} />}
        </BladeStrip>
      </div>
    </StagedRoom>
  );
}

const names = Object.keys(PICTURES);

function useChosen(): string | undefined {
  const [{ picture }] = usePageSearch();
  return names.find((one) => one === picture) ?? names[0];
}

function Choice() {
  const t = useTexts();
  const [, update] = usePageSearch();
  const chosen = useChosen();
  return (
    <>
      {chosen !== undefined && (
        <SegmentedControl
          value={chosen}
          onChange={(one) => update({ picture: one === names[0] ? undefined : one })}
          data={names.map((one) => ({ value: one, label: t(`page.setup.picture.${one}`) }))}
          aria-label={t("page.setup.choose")}
          data-testid="choose-picture"
        />
      )}
      <span className={room.spacer} />
      <StagedBar />
    </>
  );
}

function Picture({ station }: { station: StationRef }) {
  const pmm = station.devices.find((device) => device.description_id === PMM);
  const pmc = station.devices.find((device) => device.description_id === PMC);
  useWatchDevice(pmm?.slug ?? null);
  useWatchDevice(pmc?.slug ?? null);
  const contexts = { pmm: useDeviceContext(pmm), pmc: useDeviceContext(pmc) };
  const chosen = useChosen();
  const Shown = chosen === undefined ? undefined : PICTURES[chosen];
  return <Suspense>{Shown && <Shown station={station} {...contexts} />}</Suspense>;
}
