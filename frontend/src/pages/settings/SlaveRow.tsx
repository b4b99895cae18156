import { Select, TagsInput, TextInput } from "@mantine/core";
import type { SiteDevice } from "../../api/settings";
import { useTexts } from "../../texts/texts";
import { ExternalStop } from "./ExternalStop";
import { useFlaw } from "./flaws";
import { ORDERS, TELEGRAMS } from "./profibusDraft";
import classes from "./Settings.module.css";

interface Props {
  /** The device's place in the site file, for what is wrong with it. */
  at: string;
  device: SiteDevice;
  onChange: (device: SiteDevice) => void;
}

/** A choice that leaves it open. */
const OPEN = "open";

/** What only a slave of PROFIBUS-DP has: telegram type, order of bytes, GSD file; and what stops its axis from outside. */
export function SlaveRow({ at, device, onChange }: Props) {
  const t = useTexts();
  const gsdFlaw = useFlaw(`${at}.gsd`);
  const modulesFlaw = useFlaw(`${at}.modules`);
  return (
    <tr data-testid={`slave-${device.slug}`}>
      <td colSpan={6} style={{ paddingLeft: 0, borderTop: "none", paddingTop: 0 }}>
        <div className={classes.row} style={{ alignItems: "flex-start" }}>
          <Select
            w={170}
            label={t("lines.site.telegram")}
            data={[
              { value: OPEN, label: t("lines.site.telegram_asked") },
              ...TELEGRAMS.map((number) => ({ value: String(number), label: String(number) })),
            ]}
            value={String(device.telegram ?? OPEN)}
            allowDeselect={false}
            onChange={(text) => onChange({ ...device, telegram: text === OPEN ? null : Number(text) })}
            data-testid="device-telegram"
          />
          <Select
            w={260}
            label={t("lines.site.order")}
            data={[
              { value: OPEN, label: t("lines.site.order_unknown") },
              ...ORDERS.map((order) => ({ value: order, label: t(`lines.orders.${order}`) })),
            ]}
            value={device.pzd_order || OPEN}
            allowDeselect={false}
            onChange={(order) => onChange({ ...device, pzd_order: order === OPEN ? "" : (order ?? "") })}
            data-testid="device-order"
          />
          <TextInput
            w={180}
            label={t("lines.site.gsd")}
            placeholder={t("lines.site.gsd_none")}
            value={device.gsd}
            error={gsdFlaw}
            maxLength={200}
            onChange={(event) => onChange({ ...device, gsd: event.currentTarget.value })}
            data-testid="device-gsd"
          />
          <TagsInput
            style={{ flex: "1 1 220px" }}
            label={t("lines.site.modules")}
            value={device.modules}
            error={modulesFlaw}
            acceptValueOnBlur
            allowDuplicates
            styles={{ input: { minHeight: 40 } }}
            onChange={(modules) => onChange({ ...device, modules })}
            data-testid="device-modules"
          />
          <ExternalStop at={at} device={device} onChange={onChange} />
          <p className={classes.places} style={{ flex: "1 1 300px", paddingTop: 4 }}>
            {t("lines.site.slave_explain")}
          </p>
        </div>
      </td>
    </tr>
  );
}
