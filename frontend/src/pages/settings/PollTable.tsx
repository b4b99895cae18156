import { ActionIcon, Button, SegmentedControl, Select, TextInput, Tooltip } from "@mantine/core";
import { IconArrowBackUp, IconFilter, IconPlus, IconTrash } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { type PollDevice, pollChoicesQuery, type PollItem } from "../../api/settings";
import { useTexts } from "../../texts/texts";
import { isUsual, MAX_ITEMS, RATES, usualDevice } from "./pollDraft";
import classes from "./Settings.module.css";

interface Props {
  device: PollDevice;
  onChange: (device: PollDevice) => void;
}

/** What is read of one kind of device, and how often. */
export function PollTable({ device, onChange }: Props) {
  const t = useTexts();
  const [filter, setFilter] = useState("");
  const usual = isUsual(device);
  const wanted = filter.trim().toLowerCase();
  const shown = device.items.filter((item) =>
    `${item.address} ${item.name} ${t.nameOf(item.name)}`.toLowerCase().includes(wanted),
  );
  const put = (changed: PollItem) =>
    onChange({
      ...device,
      items: device.items.map((item) => (item.address === changed.address ? changed : item)),
    });
  return (
    <div className={classes.card} data-testid={`poll-${device.description_id}`}>
      <div className={classes.row} style={{ marginBottom: 8 }}>
        <h2 style={{ margin: 0 }}>{device.name}</h2>
        <span className="dim">{t("page.settings.polling.count", { count: device.items.length })}</span>
        <span className={classes.spacer} />
        <TextInput
          w={200}
          aria-label={t("page.settings.polling.filter")}
          placeholder={t("page.settings.polling.filter")}
          leftSection={<IconFilter size={17} aria-hidden />}
          value={filter}
          onChange={(event) => setFilter(event.currentTarget.value)}
        />
        <Button
          variant="default"
          disabled={usual}
          leftSection={<IconArrowBackUp size={18} aria-hidden />}
          onClick={() => onChange(usualDevice(device))}
        >
          {t("page.settings.polling.usual")}
        </Button>
      </div>
      <div style={{ maxHeight: 360, overflow: "auto" }}>
        <table className={classes.table}>
          <thead>
            <tr>
              {["address", "name", "rate", "action"].map((head) => (
                <th key={head} data-head={head} style={{ position: "sticky", top: 0, zIndex: 1 }}>
                  {t(`page.settings.polling.head.${head}`)}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {shown.map((item) => (
              <ItemRow
                key={item.address}
                item={item}
                onChange={put}
                onRemove={() =>
                  onChange({ ...device, items: device.items.filter((one) => one.address !== item.address) })
                }
              />
            ))}
          </tbody>
        </table>
        {shown.length === 0 && <p className={classes.places}>{t("page.settings.polling.none_match")}</p>}
      </div>
      <AddItem device={device} onAdd={(item) => onChange({ ...device, items: [...device.items, item] })} />
    </div>
  );
}

interface RowProps {
  item: PollItem;
  onChange: (item: PollItem) => void;
  onRemove: () => void;
}

function ItemRow({ item, onChange, onRemove }: RowProps) {
  const t = useTexts();
  const name = t.nameOf(item.name);
  return (
    <tr data-testid={`poll-item-${item.address}`}>
      <td className={classes.mono}>{item.address}</td>
      <td>
        {name}
        {item.usual !== item.rate && (
          <span className="tone-warning" style={{ fontSize: 12.5 }}>
            {" · "}
            {item.usual === null
              ? t("page.settings.polling.added")
              : t("page.settings.polling.differs", { rate: t(`page.settings.rate.${item.usual}`) })}
          </span>
        )}
      </td>
      <td>
        <SegmentedControl
          size="sm"
          aria-label={t("page.settings.polling.rate_of", { name })}
          value={item.rate}
          data={RATES.map((rate) => ({ value: rate, label: t(`page.settings.rate.${rate}`) }))}
          onChange={(rate) => onChange({ ...item, rate: rate })}
        />
      </td>
      <td style={{ textAlign: "right" }}>
        <Tooltip label={t("page.settings.polling.remove", { name })}>
          <ActionIcon aria-label={t("page.settings.polling.remove", { name })} onClick={onRemove}>
            <IconTrash size={18} aria-hidden />
          </ActionIcon>
        </Tooltip>
      </td>
    </tr>
  );
}

const SHOWN_CHOICES = 60;

function AddItem({ device, onAdd }: { device: PollDevice; onAdd: (item: PollItem) => void }) {
  const t = useTexts();
  const [open, setOpen] = useState(false);
  const choices = useQuery({ ...pollChoicesQuery(device.description_id), enabled: open }).data ?? [];
  const taken = new Set(device.items.map((item) => item.address));
  const free = choices.filter((one) => !taken.has(one.address));
  const add = (address: string | null) => {
    const chosen = free.find((one) => one.address === address);
    if (!chosen) return;
    const usual = device.usual.find((item) => item.address === chosen.address)?.rate ?? null;
    onAdd({ address: chosen.address, name: chosen.name, rate: usual ?? "slow", usual, bits: chosen.bits });
    setOpen(false);
  };
  if (device.items.length >= MAX_ITEMS) {
    return <p className={classes.places}>{t("page.settings.polling.full", { most: MAX_ITEMS })}</p>;
  }
  if (!open) {
    return (
      <Button
        mt={8}
        variant="default"
        leftSection={<IconPlus size={18} aria-hidden />}
        onClick={() => setOpen(true)}
        data-testid={`poll-add-${device.description_id}`}
      >
        {t("page.settings.polling.add")}
      </Button>
    );
  }
  return (
    <Select
      mt={8}
      maw={520}
      searchable
      autoFocus
      limit={SHOWN_CHOICES}
      aria-label={t("page.settings.polling.add")}
      placeholder={t("page.settings.polling.add_hint")}
      nothingFoundMessage={t("page.settings.polling.none_match")}
      data={free.map((one) => ({ value: one.address, label: `${one.address}  ${t.nameOf(one.name)}` }))}
      value={null}
      onChange={add}
      data-testid="poll-choose"
    />
  );
}
