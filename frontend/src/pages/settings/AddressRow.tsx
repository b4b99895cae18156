import { TextInput } from "@mantine/core";
import type { SiteDevice } from "../../api/settings";
import { useTexts } from "../../texts/texts";
import { ExternalStop } from "./ExternalStop";
import { useFlaw } from "./flaws";
import classes from "./Settings.module.css";

interface Props {
  /** The device's place in the site file, for what is wrong with it. */
  at: string;
  device: SiteDevice;
  onChange: (device: SiteDevice) => void;
}

/** What only a device of Modbus TCP has: where it listens, and what stops its axis from outside. */
export function AddressRow({ at, device, onChange }: Props) {
  const t = useTexts();
  const addressFlaw = useFlaw(`${at}.address`);
  return (
    <tr data-testid={`address-of-${device.slug}`}>
      <td colSpan={6} style={{ paddingLeft: 0, borderTop: "none", paddingTop: 0 }}>
        <div className={classes.row} style={{ alignItems: "flex-start" }}>
          <TextInput
            w={236}
            label={t("page.settings.modbus.address")}
            value={device.address}
            error={addressFlaw}
            onChange={(event) => onChange({ ...device, address: event.currentTarget.value })}
            data-testid="device-address"
          />
          <ExternalStop at={at} device={device} onChange={onChange} />
          <p className={classes.places} style={{ flex: "1 1 300px", paddingTop: 4 }}>
            {t("page.settings.modbus.external_stop_explain")}
          </p>
        </div>
      </td>
    </tr>
  );
}
