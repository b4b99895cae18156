import { Autocomplete, Button, Checkbox, FileInput, Group, Select, Stack, TextInput } from "@mantine/core";
import { IconFileImport } from "@tabler/icons-react";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { queryClient, turbineQuery } from "../../../api/queries";
import { library, setsQuery, type SetTaken } from "../../../api/sets";
import { NeedsRole } from "../../../frame/NeedsRole";
import { usePageSearch } from "../../../frame/search";
import { useTexts } from "../../../texts/texts";
import { ProblemAlert } from "../../../ui/ProblemAlert";
import room from "../../../ui/Room.module.css";
import { placesOf } from "../../../ui/devices";
import { Dialog } from "../../../ui/Dialog";

const KINDS = ["oat-pmm", "oat-pmc", "nanotec-pd4e", "wandfluh-ed2"];
const PIECE = 0x8000;

/** A file into the library: JSON, DCF or CSV. */
export function ImportSet() {
  const t = useTexts();
  const [open, setOpen] = useState(false);
  return (
    <>
      <NeedsRole role="technician">
        {(locked) => (
          <Button
            variant="default"
            disabled={locked}
            leftSection={<IconFileImport size={18} aria-hidden />}
            onClick={() => setOpen(true)}
            data-testid="import-set"
          >
            {t("page.sets.import.open")}
          </Button>
        )}
      </NeedsRole>
      {open && <ImportDialog onClose={() => setOpen(false)} />}
    </>
  );
}

function ImportDialog({ onClose }: { onClose: () => void }) {
  const t = useTexts();
  const [, update] = usePageSearch();
  const taking = useMutation({
    mutationFn: library.importFile,
    onSuccess: () => queryClient.invalidateQueries({ queryKey: setsQuery.queryKey }),
  });
  return (
    <Dialog opened onClose={onClose} title={t("page.sets.import.title")} size="lg">
      {taking.data ? (
        <Taken
          taken={taking.data}
          onOpen={() => {
            update({ file: taking.data.record.id });
            onClose();
          }}
        />
      ) : (
        <Form error={taking.error} busy={taking.isPending} onTake={(file) => taking.mutate(file)} />
      )}
    </Dialog>
  );
}

interface FormProps {
  error: unknown;
  busy: boolean;
  onTake: (file: Parameters<typeof library.importFile>[0]) => void;
}

function Form({ error, busy, onTake }: FormProps) {
  const t = useTexts();
  const [file, setFile] = useState<File | null>(null);
  const [device, setDevice] = useState("");
  const [kind, setKind] = useState<string | null>(null);
  const [asValues, setAsValues] = useState(false);
  const [reason, setReason] = useState("");
  const turbine = useQuery(turbineQuery).data ?? undefined;
  const take = async () => {
    if (!file) return;
    onTake({
      name: file.name,
      data: base64(new Uint8Array(await file.arrayBuffer())),
      device: device.trim() === "" ? null : device.trim(),
      description_id: kind,
      as_values: asValues,
      reason: reason.trim(),
    });
  };
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault();
        void take();
      }}
    >
      <Stack>
        <FileInput
          label={t("page.sets.import.file")}
          placeholder={t("page.sets.import.choose")}
          description={t("page.sets.import.kinds")}
          accept=".json,.dcf,.csv,.eds"
          styles={{ input: { minHeight: 40 } }}
          value={file}
          onChange={setFile}
          data-testid="import-file"
        />
        <Group grow align="flex-start">
          <Autocomplete
            label={t("page.sets.import.device")}
            description={t("page.sets.import.device_hint")}
            data={placesOf(turbine).map((place) => place.device.slug)}
            value={device}
            onChange={setDevice}
            data-testid="import-device"
          />
          <Select
            label={t("page.sets.import.description")}
            description={t("page.sets.import.description_hint")}
            placeholder={t("page.sets.import.found_out")}
            data={KINDS}
            value={kind}
            onChange={setKind}
            clearable
          />
        </Group>
        <TextInput
          label={t("page.sets.import.reason")}
          value={reason}
          maxLength={500}
          onChange={(event) => setReason(event.currentTarget.value)}
        />
        <Checkbox
          label={t("page.sets.import.as_values")}
          description={t("page.sets.import.as_values_hint")}
          checked={asValues}
          onChange={(event) => setAsValues(event.currentTarget.checked)}
          data-testid="import-as-values"
        />
        {error !== null && <ProblemAlert error={error} title={t("page.sets.import.failed")} />}
        <Group justify="flex-end">
          <Button type="submit" disabled={!file} loading={busy} data-testid="import-take">
            {t("page.sets.import.take")}
          </Button>
        </Group>
      </Stack>
    </form>
  );
}

function Taken({ taken: { record, unknown, foreign }, onOpen }: { taken: SetTaken; onOpen: () => void }) {
  const t = useTexts();
  return (
    <Stack data-testid="import-taken">
      <p style={{ margin: 0 }}>
        {t("page.sets.import.taken", { values: record.values, device: record.origin.device })}{" "}
        {foreign && record.unread > 0 && t("page.sets.import.missing", { count: record.unread })}
      </p>
      {unknown.length > 0 && (
        <>
          <h3 style={{ margin: 0 }}>{t("page.sets.import.unknown", { count: unknown.length })}</h3>
          <ul className={room.list}>
            {unknown.map((one) => (
              <li key={one.address}>
                <span>
                  {one.address} {one.name}
                </span>
                <span className="dim">
                  {t("page.sets.import.line", { line: one.line, reason_key: one.text_key })}
                </span>
              </li>
            ))}
          </ul>
        </>
      )}
      <Group justify="flex-end">
        <Button onClick={onOpen} data-testid="import-open">
          {t("page.sets.import.show")}
        </Button>
      </Group>
    </Stack>
  );
}

function base64(bytes: Uint8Array): string {
  const pieces = [];
  for (let at = 0; at < bytes.length; at += PIECE)
    pieces.push(String.fromCharCode(...bytes.subarray(at, at + PIECE)));
  return btoa(pieces.join(""));
}
