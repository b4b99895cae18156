import { Button, Menu } from "@mantine/core";
import { IconChevronDown } from "@tabler/icons-react";
import { useMemo } from "react";
import type { FleetDevice, FleetDoc, FleetMark } from "../../../api/fleet";
import { usePageSearch } from "../../../frame/search";
import { type Translate, useTexts } from "../../../texts/texts";
import { DataTable, type TableColumn } from "../../../ui/DataTable";
import { useFleetDevice } from "./deviceLabel";
import classes from "./Fleet.module.css";
import type { FleetNames } from "./names";
import { useOpenComparison } from "./open";

/** The strongest shade, in percent: text on it can still be read. */
const DEEPEST = 40;
const CELL = "minmax(94px, 1fr)";

type Open = ReturnType<typeof useOpenComparison>;

/** Devices by groups, each a number and a shade; of one group, devices by parameters. */
export function HeatMap({ doc, names }: { doc: FleetDoc; names: FleetNames }) {
  const t = useTexts();
  const [search] = usePageSearch();
  const nameOf = useFleetDevice();
  const open = useOpenComparison(doc);
  const group = doc.marked.length > 0 ? search.group : undefined;
  const columns = useMemo((): TableColumn<FleetDevice>[] => {
    const device: TableColumn<FleetDevice> = {
      id: "device",
      title: t("page.fleet.column.device"),
      width: "170px",
      text: (one) => nameOf(one.device),
      fixed: true,
    };
    return [
      device,
      ...(group === undefined ? groupColumns(doc, names, open, t) : markColumns(doc, names, t)),
    ];
  }, [doc, names, nameOf, open, group, t]);
  return (
    <DataTable
      label={t("page.fleet.view.map")}
      name="fleet"
      rows={doc.devices}
      columns={columns}
      idOf={(one) => one.device}
      fileName="hubside-fleet-map"
      empty={t("page.fleet.no_devices")}
      onOpen={(one) => open(one, group)}
      tallHead
      tools={<GroupMenu doc={doc} names={names} />}
    />
  );
}

function groupColumns(
  doc: FleetDoc,
  names: FleetNames,
  open: Open,
  t: Translate,
): TableColumn<FleetDevice>[] {
  const most = Math.max(1, ...doc.devices.flatMap((one) => one.by_group));
  const total: TableColumn<FleetDevice> = {
    id: "different",
    title: t("page.fleet.column.total"),
    width: "70px",
    numeric: true,
    text: (one) => `${one.different}`,
    by: (one) => one.different,
  };
  const groups = doc.groups.map((id, at): TableColumn<FleetDevice> => ({
    id: `group-${id}`,
    title: names.group(id),
    width: CELL,
    numeric: true,
    text: (one) => countText(one.by_group[at] ?? 0, one.missing_by_group[at] ?? 0),
    by: (one) => one.by_group[at] ?? 0,
    cell: (one) => (
      <Shade
        count={one.by_group[at] ?? 0}
        missing={one.missing_by_group[at] ?? 0}
        most={most}
        onOpen={() => open(one, id)}
      />
    ),
  }));
  return [total, ...groups];
}

/** Differences, and how many parameters are missing: of those, nothing is known, which is no 0. */
function countText(count: number, missing: number): string {
  if (missing === 0) return `${count}`;
  return count === 0 ? `∅ ${missing}` : `${count} · ∅ ${missing}`;
}

/** By keyboard, Enter on the row opens all groups; the pointer has the group at once. */
function Shade({
  count,
  missing,
  most,
  onOpen,
}: {
  count: number;
  missing: number;
  most: number;
  onOpen: () => void;
}) {
  const t = useTexts();
  const percent = count === 0 ? 0 : 8 + (count / most) * (DEEPEST - 8);
  return (
    <button
      type="button"
      tabIndex={-1}
      className={classes.shade}
      onClick={(event) => {
        event.stopPropagation();
        onOpen();
      }}
      data-zero={count === 0 && missing === 0}
      data-missing={missing > 0}
      title={missing > 0 ? `${missing} ${t("page.fleet.mark.missing")}` : undefined}
      style={{ background: `color-mix(in srgb, var(--hs-warn) ${percent.toFixed(0)}%, transparent)` }}
    >
      {countText(count, missing)}
    </button>
  );
}

const SIGNS: Record<FleetMark, string> = { same: "=", different: "≠", unit: "⚓", missing: "∅" };

function markColumns(doc: FleetDoc, names: FleetNames, t: Translate): TableColumn<FleetDevice>[] {
  return doc.marked.map((address, at): TableColumn<FleetDevice> => ({
    id: `at-${address}`,
    title: `${address} ${names.parameter(address)}`,
    width: "minmax(104px, 1fr)",
    text: (one) => t(`page.fleet.mark.${one.marks[at] ?? "same"}`),
    by: (one) => (one.marks[at] === "different" ? 1 : 0),
    cell: (one) => {
      const mark = one.marks[at] ?? "same";
      return (
        <span className={classes.mark} data-mark={mark}>
          <span aria-hidden>{SIGNS[mark]}</span> {t(`page.fleet.mark.${mark}`)}
        </span>
      );
    },
  }));
}

function GroupMenu({ doc, names }: { doc: FleetDoc; names: FleetNames }) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const pick = (group: string | undefined) => update({ group, order: undefined, less: undefined });
  return (
    <Menu position="bottom-end">
      <Menu.Target>
        <Button
          variant={search.group === undefined ? "default" : "light"}
          px="sm"
          rightSection={<IconChevronDown size={15} aria-hidden />}
          data-testid="fleet-group"
        >
          {search.group === undefined ? t("page.compare.every_group") : names.group(search.group)}
        </Button>
      </Menu.Target>
      <Menu.Dropdown mah={460} style={{ overflow: "auto" }}>
        <Menu.Item mih={40} onClick={() => pick(undefined)}>
          {t("page.compare.every_group")}
        </Menu.Item>
        {doc.groups.map((id) => (
          <Menu.Item key={id} mih={40} onClick={() => pick(id)} data-testid={`fleet-group-${id}`}>
            {names.group(id)}
          </Menu.Item>
        ))}
      </Menu.Dropdown>
    </Menu>
  );
}
