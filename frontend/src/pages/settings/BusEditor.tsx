import { ActionIcon, Button, Select, TextInput, Tooltip } from "@mantine/core";
import { IconPlus, IconRadar2, IconTrash } from "@tabler/icons-react";
import { useState } from "react";
import { type Site, type SiteBus, type SiteTurbine } from "../../api/settings";
import { useTexts } from "../../texts/texts";
import { AddressPanel } from "./AddressPanel";
import { CanFields, LineFields, RangeFields } from "./BusFields";
import { useFlaw } from "./flaws";
import { asModbus, isModbus } from "./modbusDraft";
import { asProfibus, type BusKind, kindOf, portOf } from "./profibusDraft";
import { ScanPanel } from "./ScanPanel";
import classes from "./Settings.module.css";
import { NEW_BUS } from "./siteDraft";

interface Props {
  site: Site;
  draft: SiteTurbine;
  /** As it stands in the file; null for a new turbine. */
  before: SiteTurbine | null;
  onChange: (draft: SiteTurbine) => void;
}

/** The buses of a turbine. A CAN bus can be scanned, one of Modbus TCP asked address by address, and devices taken over. */
export function BusEditor({ site, draft, before, onChange }: Props) {
  const t = useTexts();
  const [scanning, setScanning] = useState<string | null>(null);
  const none = useFlaw("bus");
  const put = (at: number, bus: SiteBus) =>
    onChange(renamed({ ...draft, buses: draft.buses.with(at, bus) }, draft.buses[at]?.name, bus.name));
  return (
    <div className={classes.card}>
      <h2>{t("page.settings.turbines.buses")}</h2>
      {none !== undefined && <p className="tone-error">{none}</p>}
      {draft.buses.map((bus, at) => (
        <div key={at} style={{ marginBottom: 10 }}>
          <BusRow
            bus={bus}
            fixed={before?.buses.some((one) => one.name === bus.name) ?? false}
            onChange={(changed) => put(at, changed)}
            onRemove={() => onChange({ ...draft, buses: draft.buses.toSpliced(at, 1) })}
            scanning={scanning === bus.name}
            onScan={() => setScanning(scanning === bus.name ? null : bus.name)}
          />
          {scanning === bus.name && isModbus(bus) && (
            <AddressPanel bus={bus} draft={draft} site={site} onAdded={onChange} />
          )}
          {scanning === bus.name && !isModbus(bus) && (
            <ScanPanel
              key={bus.connection}
              bus={bus}
              draft={draft}
              descriptions={site.descriptions.filter((one) => one.bus === kindOf(bus))}
              onTaken={onChange}
            />
          )}
        </div>
      ))}
      <Button
        variant="default"
        leftSection={<IconPlus size={18} aria-hidden />}
        onClick={() => onChange({ ...draft, buses: [...draft.buses, newBus(draft)] })}
      >
        {t("page.settings.turbines.add_bus")}
      </Button>
    </div>
  );
}

function newBus(draft: SiteTurbine): SiteBus {
  const taken = draft.buses.map((bus) => bus.name);
  const name = ["can0", "can1", "can2", "can3"].find((one) => !taken.includes(one)) ?? "";
  return { name, ...NEW_BUS };
}

/** Devices follow a bus that gets another name. */
function renamed(draft: SiteTurbine, from: string | undefined, to: string): SiteTurbine {
  if (from === undefined || from === to) return draft;
  const stations = draft.stations.map((station) => ({
    ...station,
    devices: station.devices.map((device) => (device.bus === from ? { ...device, bus: to } : device)),
  }));
  return { ...draft, stations };
}

interface RowProps {
  bus: SiteBus;
  fixed: boolean;
  scanning: boolean;
  onChange: (bus: SiteBus) => void;
  onRemove: () => void;
  onScan: () => void;
}

function BusRow({ bus, fixed, onChange, onRemove, scanning, onScan }: RowProps) {
  const t = useTexts();
  const at = `bus.${bus.name}`;
  const nameFlaw = useFlaw(`${at}.name`);
  const connectionFlaw = useFlaw(`${at}.connection`);
  const rangesFlaw = useFlaw(`${at}.ranges`);
  const tcp = isModbus(bus);
  const kind = kindOf(bus);
  const Fields = FIELDS[kind];
  const incomplete = {
    canopen: bus.connection === "",
    "modbus-tcp": bus.ranges.length === 0 || rangesFlaw !== undefined,
    "profibus-dp": portOf(bus) === "",
  }[kind];
  return (
    <div className={classes.row} style={{ alignItems: "flex-start" }}>
      <TextInput
        w={92}
        label={t("page.settings.turbines.bus_name")}
        value={bus.name}
        error={nameFlaw}
        readOnly={fixed}
        variant={fixed ? "filled" : "default"}
        onChange={(event) => onChange({ ...bus, name: event.currentTarget.value })}
      />
      <Select
        w={158}
        label={t("page.settings.modbus.kind")}
        data={[
          { value: "canopen", label: t("page.settings.modbus.can") },
          { value: "modbus-tcp", label: t("page.settings.modbus.tcp") },
          { value: "profibus-dp", label: t("lines.kind.profibus-dp") },
        ]}
        value={kind}
        allowDeselect={false}
        onChange={(wanted) => wanted !== null && onChange(ofKind(bus, wanted, fixed))}
        data-testid={`bus-kind-${bus.name}`}
      />
      <Fields bus={bus} onChange={onChange} />
      <Button
        mt={22}
        variant={scanning ? "filled" : "default"}
        aria-expanded={scanning}
        leftSection={tcp ? <IconPlus size={18} aria-hidden /> : <IconRadar2 size={18} aria-hidden />}
        disabled={incomplete || connectionFlaw !== undefined}
        onClick={onScan}
        data-testid={tcp ? `by-address-${bus.name}` : `scan-${bus.name}`}
      >
        {t(tcp ? "page.settings.modbus.open" : "page.settings.scan.open")}
      </Button>
      <Tooltip label={t("page.settings.turbines.remove_bus", { bus: bus.name })}>
        <ActionIcon
          mt={22}
          aria-label={t("page.settings.turbines.remove_bus", { bus: bus.name })}
          onClick={onRemove}
        >
          <IconTrash size={18} aria-hidden />
        </ActionIcon>
      </Tooltip>
    </div>
  );
}

const FIELDS = { canopen: CanFields, "modbus-tcp": RangeFields, "profibus-dp": LineFields };

/** The bus as one of another kind; the name stays where it is permanent. */
function ofKind(bus: SiteBus, kind: BusKind, fixed: boolean): SiteBus {
  if (kind === kindOf(bus)) return bus;
  const made = {
    canopen: (): SiteBus => ({ name: bus.name, ...NEW_BUS }),
    "modbus-tcp": () => asModbus(bus),
    "profibus-dp": () => asProfibus(bus),
  }[kind]();
  return fixed ? { ...made, name: bus.name } : made;
}
