import { Alert, Checkbox } from "@mantine/core";
import { IconPlugConnectedX } from "@tabler/icons-react";
import type { WritesPlan } from "../../api/writes";
import { useTexts } from "../../texts/texts";
import { useDeviceName } from "../../ui/devices";
import classes from "./Parameters.module.css";

interface Props {
  changes: WritesPlan["address_changes"];
  confirmed: boolean;
  onConfirm: (confirmed: boolean) => void;
}

/** What becomes of the connection where a change decides at which address a device is found. To be confirmed first. */
export function ReviewAddress({ changes, confirmed, onConfirm }: Props) {
  const t = useTexts();
  const nameOf = useDeviceName();
  if (changes.length === 0) return null;
  return (
    <Alert
      color="orange"
      variant="light"
      p="sm"
      icon={<IconPlugConnectedX aria-hidden />}
      title={t("page.address_change.title")}
      data-testid="address-change"
    >
      {changes.map(({ device, addresses, connected, site_address }) => (
        <div key={device} className={classes.addressChange}>
          <p>{t("page.address_change.connected", { device: nameOf(device), connected })}</p>
          <p>
            {site_address === null
              ? t("page.address_change.site_unknown")
              : t("page.address_change.site", { address: site_address })}
          </p>
          <p className="dim">{t("page.address_change.objects", { addresses: addresses.join(", ") })}</p>
        </div>
      ))}
      <Checkbox
        mt="xs"
        label={t("page.address_change.confirm")}
        checked={confirmed}
        onChange={(event) => onConfirm(event.currentTarget.checked)}
        data-testid="address-confirm"
      />
    </Alert>
  );
}
