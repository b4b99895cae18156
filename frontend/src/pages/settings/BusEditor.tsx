import { ActionIcon, Autocomplete, Button, NumberInput, Select, TextInput, Tooltip } from "@mantine/core";
import { IconPlus, IconRadar2, IconTrash } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { adaptersQuery, type Site, type SiteBus, type SiteTurbine } from "../../api/settings";
import { useTexts } from "../../texts/texts";
import { typedNumber } from "../../ui/typedNumber";
import { kbit } from "./AdaptersSection";
import { useFlaw } from "./flaws";
import { ScanPanel } from "./ScanPanel";
import classes from "./Settings.module.css";
import { NEW_BUS } from "./siteDraft";

const RATES = [10_000, 20_000, 50_000, 125_000, 250_000, 500_000, 800_000, 1_000_000];

interface Props {
  site: Site;
  draft: SiteTurbine;
  /** As it stands in the file; null for a new turbine. */
  before: SiteTurbine | null;
  onChange: (draft: SiteTurbine) => void;
}

/** The buses of a turbine; each can be scanned, and found devices taken over into the draft. */
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
          {scanning === bus.name && (
            <ScanPanel
              key={bus.connection}
              bus={bus}
              draft={draft}
              descriptions={site.descriptions}
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

function BusRow({ bus, fixed, scanning, onChange, onRemove, onScan }: RowProps) {
  const t = useTexts();
  const at = `bus.${bus.name}`;
  const nameFlaw = useFlaw(`${at}.name`);
  const connectionFlaw = useFlaw(`${at}.connection`);
  const bitrateFlaw = useFlaw(`${at}.bitrate`);
  const heartbeatFlaw = useFlaw(`${at}.heartbeat_node`);
  const adapters = useQuery(adaptersQuery).data?.adapters ?? [];
  const inText = bus.connection.includes("@");
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
      <Autocomplete
        style={{ flex: "1 1 240px" }}
        label={t("page.settings.turbines.connection")}
        placeholder={t("page.settings.adapters.other_hint")}
        data={adapters.map((one) => one.connection)}
        value={bus.connection}
        error={connectionFlaw}
        styles={{ input: { minHeight: 40 } }}
        onChange={(connection) => onChange({ ...bus, connection })}
        data-testid="bus-connection"
      />
      <Select
        w={130}
        label={t("page.settings.adapters.bitrate")}
        data={ratesWith(bus.bitrate).map((rate) => ({
          value: String(rate),
          label: rate === 0 ? "–" : kbit(rate, t),
        }))}
        value={inText ? null : String(bus.bitrate)}
        placeholder={inText ? t("page.settings.turbines.in_connection") : undefined}
        disabled={inText}
        error={bitrateFlaw}
        allowDeselect={false}
        onChange={(text) => onChange({ ...bus, bitrate: Number(text) })}
      />
      <Tooltip label={t("page.settings.turbines.heartbeat_explain")} multiline w={280}>
        <NumberInput
          w={104}
          label={t("page.settings.turbines.heartbeat_node")}
          value={bus.heartbeat_node}
          error={heartbeatFlaw}
          min={1}
          max={127}
          allowDecimal={false}
          clampBehavior="strict"
          onChange={(value) => typedNumber(value, (node) => onChange({ ...bus, heartbeat_node: node }))}
          data-testid="heartbeat-node"
        />
      </Tooltip>
      <Button
        mt={25}
        variant={scanning ? "filled" : "default"}
        aria-expanded={scanning}
        leftSection={<IconRadar2 size={18} aria-hidden />}
        disabled={bus.connection === "" || connectionFlaw !== undefined}
        onClick={onScan}
        data-testid={`scan-${bus.name}`}
      >
        {t("page.settings.scan.open")}
      </Button>
      <Tooltip label={t("page.settings.turbines.remove_bus", { bus: bus.name })}>
        <ActionIcon
          mt={25}
          aria-label={t("page.settings.turbines.remove_bus", { bus: bus.name })}
          onClick={onRemove}
        >
          <IconTrash size={18} aria-hidden />
        </ActionIcon>
      </Tooltip>
    </div>
  );
}

const ratesWith = (rate: number): number[] =>
  RATES.includes(rate) ? RATES : [...RATES, rate].sort((a, b) => a - b);
