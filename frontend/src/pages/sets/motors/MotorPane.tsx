import { Button, CloseButton, Select } from "@mantine/core";
import { IconArrowsDiff, IconCopy, IconDownload, IconPencil } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import {
  type Motor,
  motorCommands,
  motorExport,
  type MotorForm,
  type MotorList,
  motorsChanged,
  motorVersionsQuery,
} from "../../../api/motors";
import { NeedsRole } from "../../../frame/NeedsRole";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { HoldButton } from "../../../ui/HoldButton";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { notify } from "../../../ui/notices";
import { Apply } from "./Apply";
import { InventedChip } from "./chips";
import { MotorContent } from "./MotorContent";
import { MotorEditor } from "./MotorEditor";
import classes from "./Motors.module.css";
import { placeOf, specOf, titleOf } from "./places";

interface Props {
  /** `ID` or `ID@VERSION`. */
  place: string;
  list: MotorList;
  form: MotorForm;
}

/** One motor, in any of its versions: what it is, and what can be done with it. */
export function MotorPane({ place, list, form }: Props) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const [editing, setEditing] = useState(false);
  const { id, version } = placeOf(place);
  const versions = useQuery(motorVersionsQuery(id));
  if (versions.isError) return <ProblemAlert error={versions.error} title={t("page.motors.failed")} />;
  const newest = versions.data?.[0];
  const motor = versions.data?.find((one) => version === null || one.version === version);
  if (!newest || !motor) return <p className={classes.body}>{t("page.loading")}</p>;
  if (editing) return <MotorEditor form={form} motor={motor} onDone={() => setEditing(false)} />;
  const close = () => update({ motor: undefined });
  return (
    <>
      <div className={classes.head}>
        <h2 data-testid="motor-title">{titleOf(motor)}</h2>
        <InventedChip motor={motor} />
        {motor.deleted && <span className={classes.plain}>{t("page.motors.deleted_mark")}</span>}
        <Versions versions={versions.data ?? []} shown={motor} />
        <CloseButton aria-label={t("page.close")} onClick={close} />
      </div>
      <div className={classes.bar}>
        <NeedsRole role="technician">
          {(locked) => (
            <Button
              leftSection={
                motor.invented ? <IconCopy size={17} aria-hidden /> : <IconPencil size={17} aria-hidden />
              }
              disabled={locked || motor.version !== newest.version}
              onClick={() => setEditing(true)}
              data-testid="motor-edit"
            >
              {t(motor.invented ? "page.motors.template" : "page.motors.edit")}
            </Button>
          )}
        </NeedsRole>
        <Button
          variant="default"
          leftSection={<IconArrowsDiff size={17} aria-hidden />}
          onClick={() => update({ columns: `${specOf(motor)}@${motor.version},`, motor: undefined })}
          data-testid="motor-compare-this"
        >
          {t("page.motors.compare")}
        </Button>
        <Button
          component="a"
          href={motorExport(motor.id)}
          download="hubside-motor.csv"
          variant="default"
          leftSection={<IconDownload size={17} aria-hidden />}
        >
          {t("page.motors.export_one")}
        </Button>
        {!motor.invented && !motor.deleted && <Delete motor={motor} onDone={close} />}
      </div>
      <Apply motor={motor} form={form} />
      <div className={classes.body} role="region" aria-label={t("page.motors.content")} tabIndex={0}>
        <MotorContent motor={motor} list={list} form={form} />
      </div>
    </>
  );
}

/** Each change made another version; all of them can be looked at. */
function Versions({ versions, shown }: { versions: readonly Motor[]; shown: Motor }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  if (versions.length < 2)
    return <span className="dim">{t("page.motors.version", { version: shown.version })}</span>;
  const data = versions.map((one) => ({
    value: String(one.version),
    label: t("page.motors.version", { version: one.version }),
  }));
  return (
    <Select
      w={130}
      aria-label={t("page.motors.versions")}
      data={data}
      value={String(shown.version)}
      allowDeselect={false}
      onChange={(version) => update({ motor: `${shown.id}@${version ?? shown.version}` })}
      data-testid="motor-versions"
    />
  );
}

function Delete({ motor, onDone }: { motor: Motor; onDone: () => void }) {
  const t = useTexts();
  const erase = useMutation({
    mutationFn: () => motorCommands.remove(motor.id),
    onSuccess: async () => {
      onDone();
      await motorsChanged();
      notify({ tone: "ok", title: t("page.motors.deleted", { motor: titleOf(motor) }), lines: [] });
    },
  });
  return (
    <>
      <NeedsRole role="expert">
        {(locked) => (
          <HoldButton
            tone="danger"
            hint={t("page.motors.delete_hint")}
            disabled={locked || erase.isPending}
            onHeld={erase.mutate}
            testId="motor-delete"
          >
            {t("page.motors.delete")}
          </HoldButton>
        )}
      </NeedsRole>
      {erase.isError && <ProblemAlert error={erase.error} title={t("page.motors.refused")} />}
    </>
  );
}
