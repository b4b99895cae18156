import { Button } from "@mantine/core";
import { IconHelpCircle, IconRefresh } from "@tabler/icons-react";
import { NeedsRole } from "../../../../frame/NeedsRole";
import { useDeviceVersion } from "../../../../live/live";
import type { DeviceContext } from "../../../../model/shown";
import { useTexts } from "../../../../texts/texts";
import { useUnheard } from "../../../../ui/reading";
import { useReadAll } from "../../../parameters/readAll";
import { entriesOf } from "../../../parameters/staging";
import classes from "./Setup.module.css";

interface Props {
  device: DeviceContext | null;
  addresses: readonly string[];
}

/** How many values of a picture are not known, and the way to read them; nothing where all are. */
export function ReadNow({ device, addresses }: Props) {
  return device && <Unknown device={device} addresses={addresses} />;
}

function Unknown({ device, addresses }: { device: DeviceContext; addresses: readonly string[] }) {
  const t = useTexts();
  const { slug, doc, lookup } = device;
  useDeviceVersion(slug);
  const reading = useReadAll(slug);
  const silent = useUnheard(slug);
  const unknown = addresses.filter((one) => entriesOf(doc).has(one) && lookup(one) === null);
  if (unknown.length === 0) return null;
  return (
    <div className={classes.unknown} data-testid={`unknown-${doc.id}`}>
      <IconHelpCircle size={17} aria-hidden />
      <span>{t("page.setup.common.unknown", { count: unknown.length, device: doc.name })}</span>
      <NeedsRole role="technician" device>
        {(locked) => (
          <Button
            variant="default"
            disabled={locked || silent}
            loading={reading.running}
            leftSection={<IconRefresh size={16} aria-hidden />}
            onClick={() => reading.start([...addresses])}
            data-testid={`read-${doc.id}`}
          >
            {t("page.read.now")}
          </Button>
        )}
      </NeedsRole>
    </div>
  );
}
