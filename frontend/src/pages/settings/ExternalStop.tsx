import { TextInput } from "@mantine/core";
import type { SiteDevice } from "../../api/settings";
import { NeedsRole } from "../../frame/NeedsRole";
import { useTexts } from "../../texts/texts";
import { useFlaw } from "./flaws";

interface Props {
  /** The device's place in the site file, for what is wrong with it. */
  at: string;
  device: SiteDevice;
  onChange: (device: SiteDevice) => void;
}

/** What stops an axis from outside, where its bus cannot prove that it stops by itself; experts answer for it. */
export function ExternalStop({ at, device, onChange }: Props) {
  const t = useTexts();
  const flaw = useFlaw(`${at}.external_stop`);
  return (
    <NeedsRole role="expert">
      {(locked) => (
        <TextInput
          w={310}
          label={t("page.settings.modbus.external_stop")}
          placeholder={t("page.settings.modbus.external_stop_none")}
          value={device.external_stop}
          error={flaw}
          disabled={locked}
          maxLength={200}
          onChange={(event) => onChange({ ...device, external_stop: event.currentTarget.value })}
          data-testid="external-stop"
        />
      )}
    </NeedsRole>
  );
}
