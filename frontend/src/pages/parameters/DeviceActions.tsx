import { Button } from "@mantine/core";
import { IconDeviceFloppy, IconListCheck, IconRefresh, IconRotateClockwise2 } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { useTurbineQuery } from "../../api/queries";
import { useTexts } from "../../texts/texts";
import { placesOf } from "../../ui/devices";
import { useBenchOfTable, useDevice } from "./context";
import { RestartDialog, SaveDialog } from "./DeviceDialogs";
import classes from "./Parameters.module.css";
import { useReadAll, useReadMany } from "./readAll";
import { useSilent } from "./silent";
import { VerifyDialog } from "./VerifyDialog";

enum Dialog {
  Save,
  Restart,
  Verify,
}

/** Reading is for all that is shown; a save or a restart is always for one device, the one that was picked. */
export function DeviceActions() {
  const t = useTexts();
  const { role, recorded, side } = useBenchOfTable();
  const { slug, doc } = useDevice();
  const silent = useSilent(slug);
  const turbine = useQuery(useTurbineQuery()).data;
  const verifies = placesOf(turbine).some(({ device }) => device.slug === slug && device.verifies);
  const [dialog, setDialog] = useState<Dialog | null>(null);
  const close = () => setDialog(null);
  const barred = recorded || silent || role === "viewer";
  return (
    <div className={classes.icons}>
      <ReadAllButton />
      {!side && (
        <>
          <Button
            px="sm"
            variant="default"
            leftSection={<IconDeviceFloppy size={17} aria-hidden />}
            disabled={barred}
            onClick={() => setDialog(Dialog.Save)}
            data-testid="save"
          >
            {t("page.save.open")}
          </Button>
          <Button
            px="sm"
            variant="default"
            leftSection={<IconRotateClockwise2 size={17} aria-hidden />}
            disabled={barred}
            onClick={() => setDialog(Dialog.Restart)}
            data-testid="restart"
          >
            {t("page.restart.open")}
          </Button>
        </>
      )}
      {!side && verifies && (
        <Button
          px="sm"
          variant="default"
          leftSection={<IconListCheck size={17} aria-hidden />}
          disabled={barred}
          title={t("page.device_check.open_title")}
          onClick={() => setDialog(Dialog.Verify)}
          data-testid="verify"
        >
          {t("page.device_check.open")}
        </Button>
      )}
      {dialog === Dialog.Verify && <VerifyDialog onClose={close} />}
      {dialog === Dialog.Save && <SaveDialog doc={doc} onClose={close} />}
      {dialog === Dialog.Restart && <RestartDialog doc={doc} onClose={close} />}
    </div>
  );
}

function ReadAllButton() {
  const t = useTexts();
  const { role, recorded, devices } = useBenchOfTable();
  const { slug } = useDevice();
  const reading = useReadAll(slug);
  const readMany = useReadMany();
  const silent = useSilent(slug);
  return (
    <Button
      px="sm"
      variant="default"
      leftSection={<IconRefresh size={17} aria-hidden />}
      disabled={recorded || (silent && devices.length === 1) || reading.running || role === "viewer"}
      onClick={() => readMany(devices.map((one) => one.slug))}
      data-testid="read-all"
    >
      {t("page.read.all")}
    </Button>
  );
}
