import { ActionIcon, SegmentedControl, Tooltip } from "@mantine/core";
import { IconStar, IconStarFilled, IconX } from "@tabler/icons-react";
import { type KeyboardEvent, useEffect, useRef } from "react";
import { lockOf } from "../../model/locks";
import type { ParameterRow } from "../../model/rows";
import { useBenchOfTable, useDevice } from "./context";
import { Facts } from "./Facts";
import { Locked, PanelEditor } from "./PanelEditor";
import classes from "./Parameters.module.css";

interface Props {
  row: ParameterRow;
  onDevice: (slug: string) => void;
  onOpen: (address: string) => void;
  onClose: () => void;
}

/** Everything about one parameter beside the table, and its editor where it may be written. */
export function DetailPanel({ row, onDevice, onOpen, onClose }: Props) {
  const { t, slug } = useDevice();
  const { role, recorded, side, devices, nameOf } = useBenchOfTable();
  const panel = useRef<HTMLElement>(null);
  const { entry, title } = row;
  const lock = lockOf(entry, role, recorded);
  useEffect(() => {
    const first = panel.current?.querySelector<HTMLElement>("[data-autofocus]");
    (first ?? panel.current)?.focus({ preventScroll: true });
  }, [entry.address]);
  const onKeyDown = (event: KeyboardEvent) => {
    // While anything can move Esc is STOP, and never comes here.
    if (event.key !== "Escape" || event.defaultPrevented) return;
    event.preventDefault();
    onClose();
  };
  return (
    <aside
      ref={panel}
      className={classes.panel}
      tabIndex={-1}
      aria-label={t("page.entry.label", { name: title })}
      data-testid="detail"
      onKeyDown={onKeyDown}
    >
      <header className={classes.panelHead}>
        <div>
          <h2>{title}</h2>
          <p className="dim">
            {t("page.entry.where", { address: entry.address, device: nameOf(slug), group: row.groupTitle })}
          </p>
        </div>
        <StarButton row={row} />
        <ActionIcon
          variant="subtle"
          aria-label={t("page.close")}
          onClick={onClose}
          data-testid="detail-close"
        >
          <IconX size={18} aria-hidden />
        </ActionIcon>
      </header>
      <div className={classes.panelBody}>
        {side && (
          <SegmentedControl
            aria-label={t("page.device.pick")}
            data={devices.map((one) => ({ value: one.slug, label: nameOf(one.slug) }))}
            value={slug}
            onChange={onDevice}
            fullWidth
            data-testid="detail-device"
          />
        )}
        {lock === null ? (
          <PanelEditor key={`${slug} ${entry.address}`} entry={entry} />
        ) : (
          <Locked entry={entry} lock={lock} />
        )}
        <Facts row={row} onOpen={onOpen} />
      </div>
    </aside>
  );
}

function StarButton({ row }: { row: ParameterRow }) {
  const { t } = useDevice();
  const { starred, toggleStar } = useBenchOfTable();
  const on = starred.has(row.entry.address);
  const Star = on ? IconStarFilled : IconStar;
  return (
    <Tooltip label={t("page.favourites.tip")}>
      <ActionIcon
        variant="subtle"
        aria-label={t("page.favourites.star", { name: row.title })}
        aria-pressed={on}
        onClick={() => toggleStar(row.entry.address)}
      >
        <Star size={18} aria-hidden />
      </ActionIcon>
    </Tooltip>
  );
}
