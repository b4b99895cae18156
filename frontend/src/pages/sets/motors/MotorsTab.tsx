import { Button } from "@mantine/core";
import { IconArrowsDiff, IconDownload, IconPlugConnected, IconPlus, IconUpload } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { type ChangeEvent, useRef } from "react";
import {
  motorCommands,
  motorExport,
  motorFormQuery,
  motorsChanged,
  motorsQuery,
  type MotorsTaken,
} from "../../../api/motors";
import { NeedsRole } from "../../../frame/NeedsRole";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import room from "../../../ui/Room.module.css";
import { notify } from "../../../ui/notices";
import { FromDevice } from "./FromDevice";
import { MotorCompare } from "./MotorCompare";
import { MotorEditor } from "./MotorEditor";
import { MotorList } from "./MotorList";
import { MotorPane } from "./MotorPane";
import classes from "./Motors.module.css";
import { FROM_DEVICE, NEW } from "./places";

/** The motor database: plate data and parameters of motors, compared with one another and with devices. */
export function MotorsTab() {
  const t = useTexts();
  const list = useQuery(motorsQuery);
  const form = useQuery(motorFormQuery);
  const [search] = usePageSearch();
  const failed = list.error ?? form.error;
  return (
    <div className={room.room}>
      <Strip />
      {failed && <ProblemAlert error={failed} title={t("page.motors.failed")} />}
      <div className={classes.split}>
        <div className={classes.list}>
          <MotorList list={list.data} pending={list.isPending} narrow={isOpen(search)} />
        </div>
        {list.data && form.data && isOpen(search) && (
          <section className={classes.pane} aria-label={t("page.motors.pane")} data-testid="motor-pane">
            {search.columns !== undefined ? (
              <MotorCompare list={list.data} form={form.data} />
            ) : search.motor === NEW ? (
              <MotorEditor form={form.data} motor={undefined} onDone={undefined} />
            ) : search.motor === FROM_DEVICE ? (
              <FromDevice form={form.data} />
            ) : (
              <MotorPane key={search.motor} place={search.motor ?? ""} list={list.data} form={form.data} />
            )}
          </section>
        )}
      </div>
    </div>
  );
}

const isOpen = (search: { motor?: string; columns?: string }) =>
  search.motor !== undefined || search.columns !== undefined;

function Strip() {
  const t = useTexts();
  const [, update] = usePageSearch();
  return (
    <div className={room.strip}>
      <h1>{t("page.sets.tab.motors")}</h1>
      <NeedsRole role="technician">
        {(locked) => (
          <Button
            leftSection={<IconPlus size={18} aria-hidden />}
            disabled={locked}
            onClick={() => update({ motor: NEW, columns: undefined })}
            data-testid="motor-new"
          >
            {t("page.motors.new")}
          </Button>
        )}
      </NeedsRole>
      <NeedsRole role="technician">
        {(locked) => (
          <Button
            variant="default"
            leftSection={<IconPlugConnected size={18} aria-hidden />}
            disabled={locked}
            onClick={() => update({ motor: FROM_DEVICE, columns: undefined })}
            data-testid="motor-from-device"
          >
            {t("page.motors.from_device")}
          </Button>
        )}
      </NeedsRole>
      <Button
        variant="default"
        leftSection={<IconArrowsDiff size={18} aria-hidden />}
        onClick={() => update({ columns: ",", motor: undefined })}
        data-testid="motor-compare"
      >
        {t("page.motors.compare")}
      </Button>
      <span className={room.spacer} />
      <Import />
      <Button
        component="a"
        href={motorExport()}
        download="hubside-motors.csv"
        variant="default"
        leftSection={<IconDownload size={18} aria-hidden />}
        data-testid="motor-export"
      >
        {t("page.motors.export")}
      </Button>
    </div>
  );
}

/** A file is taken whole, or not at all; what is wrong in it is named with line and column. */
function Import() {
  const t = useTexts();
  const input = useRef<HTMLInputElement>(null);
  const take = useMutation({
    mutationFn: motorCommands.take,
    onSuccess: async (taken: MotorsTaken) => {
      await motorsChanged();
      notify({ tone: "ok", title: t("page.motors.taken", counts(taken)), lines: [] });
    },
  });
  const onChoose = (event: ChangeEvent<HTMLInputElement>) => {
    const file = event.currentTarget.files?.[0];
    if (file) take.mutate(file);
    event.currentTarget.value = "";
  };
  return (
    <>
      <NeedsRole role="technician">
        {(locked) => (
          <Button
            variant="default"
            leftSection={<IconUpload size={18} aria-hidden />}
            disabled={locked}
            loading={take.isPending}
            onClick={() => input.current?.click()}
          >
            {t("page.motors.import")}
          </Button>
        )}
      </NeedsRole>
      <input
        ref={input}
        type="file"
        accept=".csv,text/csv"
        className={classes.hidden}
        aria-label={t("page.motors.import")}
        onChange={onChoose}
        data-testid="motor-import"
      />
      {take.isError && (
        <div style={{ flexBasis: "100%", order: 9 }}>
          <ProblemAlert error={take.error} title={t("page.motors.import_failed")} />
        </div>
      )}
    </>
  );
}

const counts = (taken: MotorsTaken) => ({
  added: taken.added.length,
  changed: taken.changed.length,
  unchanged: taken.unchanged.length,
});
