import { ActionIcon, Button, NumberInput, Select, TextInput, Tooltip } from "@mantine/core";
import { IconPlus, IconTrash } from "@tabler/icons-react";
import type { Site, SiteBus, SiteDevice, SiteStation, SiteTurbine } from "../../api/settings";
import { useTexts } from "../../texts/texts";
import { AddressRow } from "./AddressRow";
import { useFlaw } from "./flaws";
import { freeNode, freeSlug, isModbus } from "./modbusDraft";
import { isProfibus, kindOf, NO_SLAVE } from "./profibusDraft";
import classes from "./Settings.module.css";
import { deviceAt, stationAt } from "./siteDraft";
import { SlaveRow } from "./SlaveRow";

interface Props {
  station: SiteStation;
  draft: SiteTurbine;
  descriptions: Site["descriptions"];
  /** The station as it stands in the file; undefined for a new one. */
  known: SiteStation | undefined;
  onChange: (station: SiteStation) => void;
  onRemove: () => void;
}

/** A blade or a bench with its devices. Identifiers of what is in the file already cannot be changed. */
export function StationEditor({ station, draft, descriptions, known, onChange, onRemove }: Props) {
  const t = useTexts();
  const at = stationAt(station);
  const nameFlaw = useFlaw(`${at}.name`);
  const slugFlaw = useFlaw(`${at}.slug`);
  const devices = (changed: SiteDevice[]) => onChange({ ...station, devices: changed });
  return (
    <div className={classes.card} data-testid={`station-${station.slug}`}>
      <div className={classes.row} style={{ alignItems: "flex-start", marginBottom: 8 }}>
        <TextInput
          w={200}
          label={t("page.settings.turbines.station")}
          value={station.name}
          error={nameFlaw ?? slugFlaw}
          onChange={(event) => onChange({ ...station, name: event.currentTarget.value })}
        />
        <span className={`${classes.mono} dim`} style={{ alignSelf: "end", paddingBottom: 11 }}>
          {draft.slug || "…"}/{station.slug}
        </span>
        <span className={classes.spacer} />
        <Tooltip label={t("page.settings.turbines.remove_station", { station: station.name })}>
          <ActionIcon
            mt={25}
            aria-label={t("page.settings.turbines.remove_station", { station: station.name })}
            onClick={onRemove}
          >
            <IconTrash size={18} aria-hidden />
          </ActionIcon>
        </Tooltip>
      </div>
      {station.devices.length > 0 && (
        <div style={{ overflowX: "auto" }}>
          <table className={classes.table}>
            <thead>
              <tr>
                {["slug", "device", "description", "bus", "node"].map((head) => (
                  <th key={head} style={{ background: "none", paddingLeft: 0 }}>
                    {t(`page.settings.turbines.${head}`)}
                  </th>
                ))}
                <th style={{ background: "none" }} aria-label={t("page.settings.adapters.head.action")} />
              </tr>
            </thead>
            <tbody>
              {station.devices.map((device, place) => (
                <DeviceRow
                  key={place}
                  at={deviceAt(station, device)}
                  device={device}
                  buses={draft.buses}
                  descriptions={descriptions}
                  fixed={known?.devices.some((one) => one.slug === device.slug) ?? false}
                  onChange={(changed) => devices(station.devices.with(place, changed))}
                  onRemove={() => devices(station.devices.toSpliced(place, 1))}
                />
              ))}
            </tbody>
          </table>
        </div>
      )}
      <Button
        mt={8}
        variant="default"
        leftSection={<IconPlus size={18} aria-hidden />}
        onClick={() => devices([...station.devices, newDevice(station, draft, descriptions)])}
        data-testid={`add-device-${station.slug}`}
      >
        {t("page.settings.turbines.add_device")}
      </Button>
    </div>
  );
}

function newDevice(station: SiteStation, draft: SiteTurbine, descriptions: Site["descriptions"]): SiteDevice {
  const bus = draft.buses[0];
  if (isModbus(bus) || isProfibus(bus)) {
    const slug = freeSlug(station);
    const kinds = descriptions.filter((one) => one.bus === kindOf(bus));
    return {
      slug,
      name: slug.toUpperCase(),
      description_id: (kinds.length === 1 ? kinds[0]?.id : undefined) ?? "",
      bus: bus?.name ?? "",
      node: freeNode(draft, bus?.name ?? ""),
      address: "",
      external_stop: "",
      ...NO_SLAVE,
    };
  }
  const taken = station.devices.map((one) => one.slug);
  const slug = ["pmm", "pmc"].find((one) => !taken.includes(one)) ?? "";
  const base = slug === "pmc" ? 10 : 0;
  return {
    slug,
    name: slug.toUpperCase(),
    description_id: slug === "" ? "" : `oat-${slug}`,
    bus: bus?.name ?? "",
    node: station.blade === null ? base + 1 : base + station.blade,
    address: "",
    external_stop: "",
    ...NO_SLAVE,
  };
}

interface DeviceProps {
  at: string;
  device: SiteDevice;
  buses: SiteBus[];
  descriptions: Site["descriptions"];
  fixed: boolean;
  onChange: (device: SiteDevice) => void;
  onRemove: () => void;
}

function DeviceRow({ at, device, buses, descriptions, fixed, onChange, onRemove }: DeviceProps) {
  const t = useTexts();
  const cell = { paddingLeft: 0, verticalAlign: "top" } as const;
  const bus = buses.find((one) => one.name === device.bus);
  const tcp = isModbus(bus);
  const fitting = descriptions.filter((one) => one.bus === kindOf(bus));
  const known = fitting.map((one) => ({ value: one.id, label: one.name }));
  const own = known.some((one) => one.value === device.description_id) || device.description_id === "";
  const slugFlaw = useFlaw(`${at}.slug`);
  const nameFlaw = useFlaw(`${at}.name`);
  const descriptionFlaw = useFlaw(`${at}.description`);
  const busFlaw = useFlaw(`${at}.bus`);
  const nodeFlaw = useFlaw(`${at}.node`);
  const moveTo = (name: string | null) => {
    const to = buses.find((one) => one.name === name);
    const stays = kindOf(to) === kindOf(bus);
    const kind = stays ? {} : { description_id: "", address: "", ...NO_SLAVE };
    onChange({ ...device, ...kind, bus: name ?? "" });
  };
  return (
    <>
      <tr data-testid={`device-${device.slug}`}>
        <td style={cell}>
          <TextInput
            w={104}
            aria-label={t("page.settings.turbines.slug")}
            value={device.slug}
            error={slugFlaw}
            readOnly={fixed}
            variant={fixed ? "filled" : "default"}
            onChange={(event) => onChange({ ...device, slug: event.currentTarget.value })}
          />
        </td>
        <td style={cell}>
          <TextInput
            w={120}
            aria-label={t("page.settings.turbines.device")}
            value={device.name}
            error={nameFlaw}
            onChange={(event) => onChange({ ...device, name: event.currentTarget.value })}
          />
        </td>
        <td style={cell}>
          <Select
            w={160}
            aria-label={t("page.settings.turbines.description")}
            data={own ? known : [...known, { value: device.description_id, label: device.description_id }]}
            value={device.description_id || null}
            error={descriptionFlaw}
            allowDeselect={false}
            onChange={(id) => onChange({ ...device, description_id: id ?? "" })}
          />
        </td>
        <td style={cell}>
          <Select
            w={92}
            aria-label={t("page.settings.turbines.bus")}
            data={buses.map((one) => one.name).filter((name) => name !== "")}
            value={bus?.name ?? null}
            error={busFlaw}
            allowDeselect={false}
            onChange={moveTo}
          />
        </td>
        <td style={cell}>
          <NumberInput
            w={84}
            aria-label={t("page.settings.turbines.node")}
            value={device.node}
            error={nodeFlaw}
            hideControls
            allowDecimal={false}
            allowNegative={false}
            styles={{ input: { minHeight: 40 } }}
            onChange={(node) => onChange({ ...device, node: typeof node === "number" ? node : 0 })}
            data-testid="device-node"
          />
        </td>
        <td style={{ ...cell, paddingRight: 0, textAlign: "right" }}>
          <Tooltip label={t("page.settings.turbines.remove_device", { device: device.name })}>
            <ActionIcon
              aria-label={t("page.settings.turbines.remove_device", { device: device.name })}
              onClick={onRemove}
            >
              <IconTrash size={18} aria-hidden />
            </ActionIcon>
          </Tooltip>
        </td>
      </tr>
      {tcp && <AddressRow at={at} device={device} onChange={onChange} />}
      {isProfibus(bus) && <SlaveRow at={at} device={device} onChange={onChange} />}
    </>
  );
}
