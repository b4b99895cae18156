import { Autocomplete, NumberInput, Select, TagsInput, TextInput, Tooltip } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { adaptersQuery, type SiteBus } from "../../api/settings";
import { figure } from "../../model/values";
import { type Translate, useTexts } from "../../texts/texts";
import { typedNumber } from "../../ui/typedNumber";
import { kbit } from "./AdaptersSection";
import { useFlaw } from "./flaws";
import { LAST_SLAVE, LINE_RATES, portOf, PROFIBUS } from "./profibusDraft";

const RATES = [10_000, 20_000, 50_000, 125_000, 250_000, 500_000, 800_000, 1_000_000];

interface Props {
  bus: SiteBus;
  onChange: (bus: SiteBus) => void;
}

/** How a CAN bus is reached: adapter, bit rate, and the node as which this tool beats on it. */
export function CanFields({ bus, onChange }: Props) {
  const t = useTexts();
  const at = `bus.${bus.name}`;
  const connectionFlaw = useFlaw(`${at}.connection`);
  const bitrateFlaw = useFlaw(`${at}.bitrate`);
  const heartbeatFlaw = useFlaw(`${at}.heartbeat_node`);
  const adapters = useQuery(adaptersQuery).data?.adapters ?? [];
  const inText = bus.connection.includes("@");
  return (
    <>
      <Autocomplete
        style={{ flex: "1 1 200px" }}
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
    </>
  );
}

/** Which addresses may be asked on a bus of Modbus TCP; nothing else ever is. */
export function RangeFields({ bus, onChange }: Props) {
  const t = useTexts();
  const flaw = useFlaw(`bus.${bus.name}.ranges`);
  return (
    <TagsInput
      style={{ flex: "1 1 320px" }}
      label={t("page.settings.modbus.ranges")}
      description={t("page.settings.modbus.ranges_explain")}
      inputWrapperOrder={["label", "input", "description", "error"]}
      value={bus.ranges}
      error={flaw}
      splitChars={[",", ";", " "]}
      acceptValueOnBlur
      styles={{ input: { minHeight: 40 } }}
      onChange={(ranges) => onChange({ ...bus, ranges })}
      data-testid="bus-ranges"
    />
  );
}

/** How a PROFIBUS line is reached: serial port, bit rate, and our own address on it. */
export function LineFields({ bus, onChange }: Props) {
  const t = useTexts();
  const at = `bus.${bus.name}`;
  const portFlaw = useFlaw(`${at}.connection`);
  const bitrateFlaw = useFlaw(`${at}.bitrate`);
  const masterFlaw = useFlaw(`${at}.master`);
  return (
    <>
      <TextInput
        style={{ flex: "1 1 200px" }}
        label={t("lines.site.port")}
        placeholder="/dev/ttyUSB0"
        value={portOf(bus)}
        error={portFlaw}
        onChange={(event) => onChange({ ...bus, connection: `${PROFIBUS}${event.currentTarget.value}` })}
        data-testid="line-port"
      />
      <Select
        w={140}
        label={t("page.settings.adapters.bitrate")}
        data={LINE_RATES.map((rate) => ({ value: String(rate), label: rateLabel(rate, t) }))}
        value={String(bus.bitrate)}
        error={bitrateFlaw}
        allowDeselect={false}
        onChange={(text) => onChange({ ...bus, bitrate: Number(text) })}
        data-testid="line-rate"
      />
      <Tooltip label={t("lines.site.master_explain")} multiline w={280}>
        <NumberInput
          w={104}
          label={t("lines.site.master")}
          value={bus.master}
          error={masterFlaw}
          min={1}
          max={LAST_SLAVE}
          allowDecimal={false}
          clampBehavior="strict"
          onChange={(value) => typedNumber(value, (master) => onChange({ ...bus, master }))}
          data-testid="line-master"
        />
      </Tooltip>
    </>
  );
}

/** 45.45 and 93.75 kbit/s are no whole numbers. */
const rateLabel = (rate: number, t: Translate): string =>
  `${figure(rate / 1000, rate % 1000 === 0 ? 0 : 2, t.language)} kbit/s`;

const ratesWith = (rate: number): number[] =>
  RATES.includes(rate) ? RATES : [...RATES, rate].sort((a, b) => a - b);
