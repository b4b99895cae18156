import { Button, Checkbox, CloseButton, Select } from "@mantine/core";
import { IconArrowsLeftRight, IconRefresh } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { commands } from "../../../api/client";
import {
  motorCommands,
  motorCompareQuery,
  type MotorForm,
  type MotorList,
  motorsChanged,
  type Side,
} from "../../../api/motors";
import { jobQuery } from "../../../api/queries";
import { NeedsRole } from "../../../frame/NeedsRole";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import { notify } from "../../../ui/notices";
import { ComparedRows } from "./ComparedRows";
import classes from "./Motors.module.css";
import { idOf, liveSpec, sidesOf, specOf, titleOf } from "./places";
import { useDrives } from "./useDrives";

interface Props {
  list: MotorList;
  form: MotorForm;
}

/** Two motors, or a motor and what a device holds now. */
export function MotorCompare({ list, form }: Props) {
  const t = useTexts();
  const [search, update] = usePageSearch();
  const [left, right] = sidesOf(search.columns);
  const ready = left !== "" && right !== "";
  const compared = useQuery({ ...motorCompareQuery(left, right), enabled: ready });
  const all = search.rows === "all";
  const show = (one: string, other: string) => update({ columns: `${one},${other}` });
  return (
    <>
      <div className={classes.head}>
        <h2>{t("page.motors.compare")}</h2>
        <CloseButton aria-label={t("page.close")} onClick={() => update({ columns: undefined })} />
      </div>
      <div
        className={classes.body}
        role="region"
        aria-label={t("page.motors.content")}
        tabIndex={0}
        data-testid="motor-compared"
      >
        <div className={classes.sides}>
          <SideSelect
            name="left"
            value={left}
            list={list}
            form={form}
            onChoose={(one) => show(one, right || motorOf(list, one))}
          />
          <Button
            variant="default"
            px={10}
            aria-label={t("page.motors.swap")}
            onClick={() => show(right, left)}
          >
            <IconArrowsLeftRight size={18} aria-hidden />
          </Button>
          <SideSelect
            name="right"
            value={right}
            list={list}
            form={form}
            onChoose={(other) => show(left || motorOf(list, other), other)}
          />
        </div>
        {compared.isError && <ProblemAlert error={compared.error} title={t("page.motors.failed")} />}
        {!ready && <p className="dim">{t("page.motors.choose_two")}</p>}
        {compared.data && (
          <>
            <DeviceActions sides={[compared.data.left, compared.data.right]} form={form} />
            <p className={classes.sentence} role="status" data-testid="motor-sentence">
              {t("motor.compared", countsOf(compared.data))}
            </p>
            <Checkbox
              label={t("page.motors.all_rows")}
              checked={all}
              onChange={(event) => update({ rows: event.currentTarget.checked ? "all" : undefined })}
              data-testid="motor-all-rows"
            />
            <ComparedRows doc={compared.data} form={form} all={all} />
          </>
        )}
      </div>
    </>
  );
}

type State = "different" | "same" | "missing" | "unit";

function countsOf(doc: { plate: { state: State }[]; values: { state: State }[] }): Record<State, number> {
  const counts = { different: 0, same: 0, missing: 0, unit: 0 };
  for (const row of [...doc.plate, ...doc.values]) counts[row.state] += 1;
  return counts;
}

/** A device that is chosen first brings the motor that it drives, where somebody has said which. */
function motorOf(list: MotorList, spec: string): string {
  const assigned = list.assigned.find((one) => liveSpec(one.device) === spec);
  return assigned ? `motor:${assigned.motor_id}@${assigned.version}` : "";
}

interface SelectProps extends Props {
  name: "left" | "right";
  value: string;
  onChoose: (spec: string) => void;
}

function SideSelect({ name, value, list, form, onChoose }: SelectProps) {
  const t = useTexts();
  const drives = useDrives(form).map((one) => ({ ...one, value: liveSpec(one.value) }));
  const motors = list.motors.map((motor) => ({
    value: specOf(motor),
    label: motor.invented ? `${motor.type} – ${t("motor.source.example")}` : titleOf(motor),
  }));
  // An earlier version, or a motor that is no longer listed, is a choice too while it is chosen.
  const known = [...drives, ...motors].some((one) => one.value === value);
  const named = list.motors.find((motor) => motor.id === idOf(value));
  const label = named ? `${titleOf(named)} @${value.split("@")[1] ?? ""}` : value;
  const extra = value === "" || known ? [] : [{ value, label }];
  return (
    <Select
      label={t(`page.motors.${name}`)}
      placeholder={t("page.motors.choose")}
      data={[
        { group: t("page.motors.devices"), items: drives },
        { group: t("page.sets.tab.motors"), items: [...extra, ...motors] },
      ]}
      value={value === "" ? null : value}
      allowDeselect={false}
      searchable
      onChange={(chosen) => onChoose(chosen ?? "")}
      data-testid={`motor-${name}`}
    />
  );
}

/** Of a device: read what it holds now, and note that this is its motor. */
function DeviceActions({ sides, form }: { sides: readonly Side[]; form: MotorForm }) {
  const t = useTexts();
  const device = sides.find((side) => side.device !== null)?.device;
  const motor = sides.find((side) => side.motor !== null)?.motor;
  const read = useMutation({
    mutationFn: (slug: string) =>
      commands.read(
        slug,
        form.description.entries.map((entry) => entry.address),
      ),
  });
  const job = useQuery(jobQuery(read.data?.id ?? null)).data;
  const reading = read.isPending || job?.state === "running";
  const done = job?.state === "done";
  useQuery({
    queryKey: ["motors-read", job?.id],
    queryFn: async () => {
      await motorsChanged();
      return null;
    },
    enabled: done,
  });
  const assign = useMutation({
    mutationFn: (slug: string) => motorCommands.assign(motor?.id ?? "", motor?.version ?? 0, slug),
    onSuccess: async (_done, slug) => {
      await motorsChanged();
      notify({ tone: "ok", title: t("page.motors.assigned", { device: slug }), lines: [] });
    },
  });
  if (device == null) return null;
  const failed = read.error ?? assign.error;
  return (
    <div style={{ display: "flex", flexWrap: "wrap", gap: 10, paddingTop: 12 }}>
      <NeedsRole role="technician" device>
        {(locked) => (
          <Button
            variant="default"
            leftSection={<IconRefresh size={17} aria-hidden />}
            disabled={locked}
            loading={reading}
            onClick={() => read.mutate(device)}
            data-testid="motor-read-device"
          >
            {t("page.motors.read_device")}
          </Button>
        )}
      </NeedsRole>
      {motor && (
        <NeedsRole role="technician">
          {(locked) => (
            <Button
              variant="default"
              disabled={locked}
              loading={assign.isPending}
              onClick={() => assign.mutate(device)}
              data-testid="motor-assign"
            >
              {t("page.motors.assign")}
            </Button>
          )}
        </NeedsRole>
      )}
      {failed !== null && <ProblemAlert error={failed} title={t("page.motors.refused")} />}
    </div>
  );
}
