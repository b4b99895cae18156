import { Badge, Button, NumberInput, Select, TextInput } from "@mantine/core";
import { IconArrowBarToDown, IconPlugConnected } from "@tabler/icons-react";
import { useState } from "react";
import {
  type Identified,
  settings,
  type Site,
  type SiteBus,
  type SiteDevice,
  type SiteTurbine,
} from "../../api/settings";
import { NeedsRole } from "../../frame/NeedsRole";
import { useTexts } from "../../texts/texts";
import { typedNumber } from "../../ui/typedNumber";
import { JobProblem } from "./JobProblem";
import {
  allows,
  deviceAtServer,
  freeNode,
  freeSlug,
  mostNodes,
  type Server,
  serverOf,
  serverText,
} from "./modbusDraft";
import { NO_SLAVE } from "./profibusDraft";
import classes from "./Settings.module.css";
import { withDevice } from "./siteDraft";
import { type StartedJob, useSettingsJob } from "./useSettingsJob";

interface Props {
  bus: SiteBus;
  draft: SiteTurbine;
  site: Site;
  onAdded: (draft: SiteTurbine) => void;
}

interface Place {
  host: string;
  unit: number;
}

/** Adds a device by its address: exactly this one is asked who it is, so that one sees what one adds. */
export function AddressPanel({ bus, draft, site, onAdded }: Props) {
  const t = useTexts();
  const work = useSettingsJob();
  const [place, setPlace] = useState<Place>({ host: "", unit: 0 });
  const server = serverOf(place.host) && serverOf(`${place.host}/${String(place.unit)}`);
  const flaw = useAddressFlaw(place.host, server, bus, draft);
  const saved =
    server !== null && site.turbines.some((one) => one.buses.some((each) => allows(each.ranges, server)));
  const ready = server !== null && flaw === null;
  const move = (changed: Place) => {
    setPlace(changed);
    work.clear(); // what was said is of another address
  };
  return (
    <div className={classes.turbine} style={{ padding: "12px 0 4px" }} data-testid="address-panel">
      <p className={classes.places}>{t("page.settings.modbus.explain")}</p>
      <div className={classes.row} style={{ alignItems: "flex-start" }}>
        <TextInput
          w={250}
          label={t("page.settings.modbus.address")}
          placeholder={t("page.settings.modbus.address_hint", { example: exampleOf(bus) })}
          value={place.host}
          error={flaw}
          onChange={(event) => move({ ...place, host: event.currentTarget.value })}
          data-testid="new-address"
        />
        <NumberInput
          w={96}
          label={t("page.settings.modbus.unit")}
          title={t("page.settings.modbus.unit_explain")}
          value={place.unit}
          min={0}
          max={255}
          allowDecimal={false}
          clampBehavior="strict"
          onChange={(value) => typedNumber(value, (unit) => move({ ...place, unit }))}
          data-testid="new-unit"
        />
        <div style={{ marginTop: 22 }}>
          <NeedsRole role="technician" device>
            {(locked) => (
              <Button
                leftSection={<IconPlugConnected size={18} aria-hidden />}
                disabled={locked || !ready || !saved}
                loading={work.running}
                onClick={() => server && work.start(() => settings.identify(serverText(server)))}
                data-testid="ask-address"
              >
                {t("page.settings.modbus.ask")}
              </Button>
            )}
          </NeedsRole>
        </div>
      </div>
      {ready && !saved && (
        <p className={classes.places} role="status">
          {t("page.settings.modbus.save_first")}
        </p>
      )}
      <Answer work={work} />
      {ready && (
        <NewDevice
          key={`${serverText(server)} ${work.job?.identified?.description_id ?? ""}`}
          server={server}
          found={work.job?.identified ?? null}
          bus={bus}
          draft={draft}
          descriptions={site.descriptions}
          onAdded={(changed) => {
            move({ host: "", unit: 0 });
            onAdded(changed);
          }}
        />
      )}
    </div>
  );
}

/** Of the first range, without what makes it a range. */
const exampleOf = (bus: SiteBus): string =>
  /^[\d.]+(?=[-/])|^[^-/]+/.exec(bus.ranges[0] ?? "")?.[0] ?? "192.168.2.20";

function useAddressFlaw(
  text: string,
  server: Server | null,
  bus: SiteBus,
  draft: SiteTurbine,
): string | null {
  const t = useTexts();
  if (text.trim() === "") return null;
  if (server === null) return t("page.settings.flaw.address");
  if (!allows(bus.ranges, server)) return t("page.settings.flaw.address_outside", { bus: bus.name });
  const device = deviceAtServer(draft, server);
  return device === undefined ? null : t("page.settings.modbus.known", { device });
}

/** Who is there, in its own words. */
function Answer({ work }: { work: StartedJob }) {
  const t = useTexts();
  const found = work.job?.identified;
  if (!found) return <JobProblem work={work} title={t("page.settings.modbus.ask_failed")} />;
  const facts = [
    ["name", found.device_name],
    ["variant", found.variant ?? found.description_id ?? t("page.settings.modbus.unrecognised")],
    ["hardware", found.hardware],
    ["firmware", found.software],
    ["serial", found.serial],
  ] as const;
  return (
    <dl className={classes.facts} data-testid="identified">
      {facts.map(([key, text]) => (
        <div key={key}>
          <dt>{t(`page.settings.modbus.facts_${key}`)}</dt>
          <dd>
            {text ?? "–"}{" "}
            {key === "name" && found.twin && (
              <Badge color="blue.8" variant="filled" tt="none">
                {t("page.mode.simulated")}
              </Badge>
            )}
          </dd>
        </div>
      ))}
    </dl>
  );
}

interface NewProps {
  server: Server;
  found: Identified | null;
  bus: SiteBus;
  draft: SiteTurbine;
  descriptions: Site["descriptions"];
  onAdded: (draft: SiteTurbine) => void;
}

/** What it is to be in the turbine; proposed, and put there by a press. */
function NewDevice({ server, found, bus, draft, descriptions, onAdded }: NewProps) {
  const t = useTexts();
  const kinds = descriptions.filter((one) => one.bus === "modbus-tcp");
  const only = kinds.length === 1 ? kinds[0]?.id : undefined;
  const first = draft.stations[0]?.slug ?? "bench";
  const [station, setStation] = useState(first);
  const [device, setDevice] = useState(() => ({
    slug: freeSlug(draft.stations.find((one) => one.slug === first)),
    description_id: found?.description_id ?? only ?? "",
    node: freeNode(draft, bus.name),
  }));
  const stations = [...new Set([...draft.stations.map((one) => one.slug), "bench"])];
  const added: SiteDevice = {
    ...device,
    name: device.slug.toUpperCase(),
    bus: bus.name,
    address: serverText(server),
    external_stop: "",
    ...NO_SLAVE,
  };
  return (
    <div className={classes.row} style={{ alignItems: "flex-end" }} data-testid="new-device">
      <Select
        w={130}
        label={t("page.settings.turbines.station")}
        data={stations}
        value={station}
        allowDeselect={false}
        onChange={(slug) => {
          setStation(slug ?? first);
          setDevice({ ...device, slug: freeSlug(draft.stations.find((one) => one.slug === slug)) });
        }}
      />
      <TextInput
        w={120}
        label={t("page.settings.modbus.device")}
        value={device.slug}
        onChange={(event) => setDevice({ ...device, slug: event.currentTarget.value })}
        data-testid="new-slug"
      />
      <Select
        w={190}
        label={t("page.settings.turbines.description")}
        data={kinds.map((one) => ({ value: one.id, label: one.name }))}
        value={device.description_id || null}
        placeholder={t("page.settings.scan.unrecognised")}
        allowDeselect={false}
        onChange={(id) => setDevice({ ...device, description_id: id ?? "" })}
      />
      <NumberInput
        w={92}
        label={t("page.settings.turbines.node")}
        value={device.node}
        min={1}
        max={mostNodes(bus)}
        allowDecimal={false}
        clampBehavior="strict"
        onChange={(value) => typedNumber(value, (node) => setDevice({ ...device, node }))}
        data-testid="new-node"
      />
      <Button
        variant="default"
        leftSection={<IconArrowBarToDown size={18} aria-hidden />}
        disabled={device.slug === "" || device.description_id === ""}
        onClick={() => onAdded(withDevice(draft, station, added))}
        data-testid="add-by-address"
      >
        {t("page.settings.modbus.add")}
      </Button>
      <span className="dim">{t("page.settings.modbus.added_note")}</span>
    </div>
  );
}
