import { Button, Select } from "@mantine/core";
import { IconArrowRight } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { turbineQuery } from "../../../api/queries";
import type { Motor, MotorForm } from "../../../api/motors";
import { NeedsRole } from "../../../frame/NeedsRole";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import classes from "./Motors.module.css";
import { useDrives } from "./useDrives";

/** Leads to a restore with this motor as the wanted values of one drive: nothing is written before its plan is seen. */
export function Apply({ motor, form }: { motor: Motor; form: MotorForm }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const drives = useDrives(form);
  const [chosen, setChosen] = useState<string | null>(null);
  const device = chosen ?? drives[0]?.value ?? null;
  const simulated = useQuery(turbineQuery).data?.mode === "twin";
  // What nobody has measured goes into no real drive; the server says so too.
  if (motor.deleted || (motor.invented && !simulated)) return null;
  return (
    <div className={classes.bar}>
      <span>{t("page.motors.apply_to")}</span>
      <Select
        aria-label={t("page.motors.device")}
        placeholder={t("page.motors.no_device")}
        data={drives}
        value={device}
        allowDeselect={false}
        disabled={drives.length === 0}
        w={310}
        onChange={setChosen}
        data-testid="motor-apply-device"
      />
      <NeedsRole role="technician">
        {(locked) => (
          <Button
            variant="default"
            rightSection={<IconArrowRight size={17} aria-hidden />}
            disabled={locked || device === null}
            onClick={() =>
              update({
                tab: "restore",
                station: device?.split("/").slice(0, -1).join("/"),
                sets: `motor:${motor.id}@${motor.version}:${device ?? ""}`,
                motor: undefined,
                find: undefined,
              })
            }
            data-testid="motor-apply"
          >
            {t("page.motors.apply")}
          </Button>
        )}
      </NeedsRole>
    </div>
  );
}
