import { Button, Checkbox, FileInput, Select } from "@mantine/core";
import { IconFileImport } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { exchange, type Format, IMPORTED } from "../../api/exchange";
import { knownTurbinesQuery } from "../../api/settings";
import { NeedsRole } from "../../frame/NeedsRole";
import { useTexts } from "../../texts/texts";
import { ProblemAlert } from "../../ui/ProblemAlert";
import { Made } from "./RecordingFilesMade";
import classes from "./RecordingFiles.module.css";
import { Dialog } from "../../ui/Dialog";

/** A file of another tool made into a recording. */
export function ImportRecording() {
  const t = useTexts();
  const [open, setOpen] = useState(false);
  return (
    <>
      <NeedsRole role="technician">
        {(locked) => (
          <Button
            variant="default"
            disabled={locked}
            leftSection={<IconFileImport size={17} aria-hidden />}
            onClick={() => setOpen(true)}
            data-testid="import-recording"
          >
            {t("page.files.import")}
          </Button>
        )}
      </NeedsRole>
      {open && <ImportDialog onClose={() => setOpen(false)} />}
    </>
  );
}

function ImportDialog({ onClose }: { onClose: () => void }) {
  const t = useTexts();
  const turbines = useQuery(knownTurbinesQuery).data ?? [];
  const [file, setFile] = useState<File | null>(null);
  const [format, setFormat] = useState<Format | null>(null);
  const [turbine, setTurbine] = useState<string | null>(null);
  const [lenient, setLenient] = useState(false);
  const taking = useMutation({ mutationFn: exchange.take });
  return (
    <Dialog opened onClose={onClose} title={t("page.files.import_title")} size="lg">
      <form
        className={classes.block}
        onSubmit={(event) => {
          event.preventDefault();
          if (file) taking.mutate({ file, format, turbine, lenient });
        }}
      >
        <FileInput
          label={t("page.files.file")}
          description={t("page.files.kinds")}
          placeholder={t("page.sets.import.choose")}
          styles={{ input: { minHeight: 40 } }}
          value={file}
          onChange={setFile}
          data-testid="import-file"
        />
        <Select
          label={t("page.files.turbine")}
          description={t("page.files.turbine_why")}
          placeholder={t("page.files.no_turbine")}
          value={turbine}
          onChange={setTurbine}
          data={turbines.map(({ slug, name }) => ({ value: slug, label: name }))}
          clearable
          data-testid="import-turbine"
        />
        <Select
          label={t("page.files.format")}
          placeholder={t("page.files.by_itself")}
          value={format}
          onChange={(value) => setFormat(IMPORTED.find((one) => one === value) ?? null)}
          data={IMPORTED.map((value) => ({ value, label: t(`page.files.format_of.${value}`) }))}
          clearable
        />
        <Checkbox
          label={t("page.files.lenient")}
          checked={lenient}
          onChange={(event) => setLenient(event.currentTarget.checked)}
        />
        {taking.isError && <ProblemAlert error={taking.error} title={t("page.files.failed")} />}
        {taking.data && <Made key={taking.data.id} id={taking.data.id} onOpened={onClose} />}
        <div className={classes.buttons}>
          <Button variant="default" onClick={onClose}>
            {t("page.close")}
          </Button>
          <Button type="submit" disabled={!file} loading={taking.isPending} data-testid="import-now">
            {t("page.files.import_now")}
          </Button>
        </div>
      </form>
    </Dialog>
  );
}
