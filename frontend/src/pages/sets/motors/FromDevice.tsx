import { Button, CloseButton, Select } from "@mantine/core";
import { IconPlugConnected } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { type SyntheticEvent, useState } from "react";
import { motorCommands, type MotorForm, motorsChanged } from "../../../api/motors";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { draftOf, type Typed } from "./motorDraft";
import classes from "./Motors.module.css";
import { PlateInputs } from "./PlateInputs";
import { useDrives } from "./useDrives";

/** A motor with the values that a device holds: read over the wire when it is added, not typed. */
export function FromDevice({ form }: { form: MotorForm }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const drives = useDrives(form);
  const [chosen, setChosen] = useState<string | null>(null);
  const [typed, setTyped] = useState<Typed>({});
  const [tried, setTried] = useState(false);
  const device = chosen ?? drives[0]?.value ?? null;
  const draft = draftOf(form, typed, t);
  const add = useMutation({
    mutationFn: ({ slug, known }: { slug: string; known: NonNullable<typeof draft> }) => {
      const { maker, type, plate, remarks } = known;
      return motorCommands.addFrom(slug, { maker, type, plate, remarks });
    },
    onSuccess: async (kept) => {
      await motorsChanged();
      update({ motor: kept.id });
    },
  });
  const onSubmit = (event: SyntheticEvent) => {
    event.preventDefault();
    setTried(true);
    if (device !== null && draft !== null && !add.isPending) add.mutate({ slug: device, known: draft });
  };
  return (
    <form onSubmit={onSubmit} noValidate style={{ display: "contents" }} data-testid="motor-from-device-form">
      <div className={classes.head}>
        <h2>{t("page.motors.from_device")}</h2>
        <CloseButton aria-label={t("page.close")} onClick={() => update({ motor: undefined })} />
      </div>
      <div className={classes.bar}>
        <Select
          aria-label={t("page.motors.device")}
          placeholder={t("page.motors.no_device")}
          data={drives}
          value={device}
          allowDeselect={false}
          disabled={drives.length === 0}
          w={310}
          onChange={setChosen}
          data-testid="motor-device"
        />
        <Button
          type="submit"
          leftSection={<IconPlugConnected size={17} aria-hidden />}
          disabled={device === null || (tried && draft === null)}
          loading={add.isPending}
          data-testid="motor-read"
        >
          {t("page.motors.read_and_add")}
        </Button>
        <span className="dim">{t("page.motors.read_why")}</span>
      </div>
      <div className={classes.body}>
        {add.isError && <ProblemAlert error={add.error} title={t("page.motors.refused")} />}
        <PlateInputs
          form={form}
          typed={typed}
          onType={(name, text) => setTyped({ ...typed, [name]: text })}
          tried={tried}
        />
      </div>
    </form>
  );
}
