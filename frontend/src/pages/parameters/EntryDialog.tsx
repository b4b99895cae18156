import { Alert, Button, Group, Modal, Stack, Text } from "@mantine/core";
import { IconArrowRight, IconCircleCheck, IconLock, IconSend } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import { commands } from "../../api/client";
import type { EntryDoc, Raw, WriteResult } from "../../api/types";
import { useCell } from "../../live/live";
import type { ParameterRow } from "../../model/rows";
import { limitText, lineOf, shownOf } from "../../model/shown";
import {
  defaultOf,
  isHex,
  isInteger,
  Misfit,
  parse,
  type Parsed,
  quantityOf,
  show,
} from "../../model/values";
import { useDeviceName } from "../../ui/devices";
import { ProblemAlert } from "../../ui/ProblemAlert";
import { rawOf } from "./cellValue";
import { useDevice } from "./context";
import { ValueEditor } from "./ValueEditor";
import classes from "./Parameters.module.css";
import { useSilent } from "./silent";

/** Everything about one parameter, and its editor where it may be written. */
export function EntryDialog({ row, onClose }: { row: ParameterRow; onClose: () => void }) {
  const { t, slug } = useDevice();
  const device = useDeviceName()(slug);
  const { entry, title } = row;
  return (
    <Modal
      opened
      onClose={onClose}
      size="lg"
      title={
        <div>
          <Text fw={700}>{title}</Text>
          <Text size="sm" className="dim">
            {t("page.entry.where", { address: entry.address, device, group: row.groupTitle })}
          </Text>
        </div>
      }
      closeButtonProps={{ "aria-label": t("page.close") }}
    >
      <Stack gap="md">
        <Places entry={entry} />
        {entry.writable ? <Editor entry={entry} onClose={onClose} /> : <Locked entry={entry} />}
      </Stack>
    </Modal>
  );
}

/** The three places of a value, told apart: RAM, non-volatile memory, and what the maker delivers. */
function Places({ entry }: { entry: EntryDoc }) {
  const context = useDevice();
  const { t } = context;
  const cell = useCell(context.slug, entry.address);
  const line = (raw: Raw | null) => (raw === null ? "–" : lineOf(shownOf(entry, raw, context)));
  const raw = rawOf(cell);
  const storedState = cell?.stored ? t(`page.stored.${cell.stored.state}`) : t("page.table.stored_unknown");
  const facts: [string, string, string][] = [
    ["ram", line(raw), raw === null ? t("page.entry.unknown") : t("page.entry.raw", { raw, hex: cell?.hex })],
    [
      "stored",
      entry.saved ? line(cell?.stored?.raw ?? null) : t("page.table.not_kept"),
      entry.saved ? storedState : "",
    ],
    ["default", line(defaultOf(entry, context.node)), ""],
    ["limits", limitText(entry, context, true) || "–", ""],
    ["type", entry.type, t(`page.access.${entry.access.replace("(w)", "_factory")}`)],
    ["section", entry.section || "–", t(`page.restore.${entry.restore}`)],
  ];
  return (
    <dl className={classes.places}>
      {facts.map(([name, value, note]) => (
        <div key={name} data-testid={`entry-${name}`}>
          <dt>{t(`page.entry.${name}`)}</dt>
          <dd>
            <b>{value}</b>
            <span className="dim">{note}</span>
          </dd>
        </div>
      ))}
      {entry.note !== null && (
        <div>
          <dt>{t("page.entry.note")}</dt>
          <dd>{t(entry.note)}</dd>
        </div>
      )}
    </dl>
  );
}

function Locked({ entry }: { entry: EntryDoc }) {
  const { t } = useDevice();
  return (
    <Alert color="gray" icon={<IconLock aria-hidden />} p="sm">
      {t(`page.locked.${entry.access.replace("(w)", "_factory")}`)}
    </Alert>
  );
}

function Editor({ entry, onClose }: { entry: EntryDoc; onClose: () => void }) {
  const context = useDevice();
  const { t, slug, doc, lookup } = context;
  const silent = useSilent(slug);
  const cell = useCell(slug, entry.address);
  const [draft, setTyped] = useState<string | null>(null);
  // Starts from the value in RAM, as soon as that is known, and does not follow it after that.
  if (draft === null && rawOf(cell) !== null) setTyped(textToEdit(entry, rawOf(cell), context));
  const typed = draft ?? "";
  const write = useMutation({ mutationFn: (raw: Raw) => commands.write(slug, entry.address, raw) });
  const parsed = parse(doc, entry, typed, lookup);
  const same = parsed.ok && parsed.raw === rawOf(cell);
  const ready = parsed.ok && !silent && !write.isPending;
  const change = (text: string) => {
    setTyped(text);
    if (!write.isPending) write.reset();
  };
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault();
        if (ready) write.mutate(parsed.raw);
      }}
    >
      <Stack gap="md">
        <ValueEditor
          entry={entry}
          typed={typed}
          onTyped={change}
          error={refusal(parsed, typed, entry, context)}
        />
        {parsed.ok && <Preview entry={entry} from={rawOf(cell)} to={parsed.raw} />}
        <Progress entry={entry} pending={write.isPending} result={write.data} />
        {write.isError && <ProblemAlert error={write.error} title={t("page.write.failed")} />}
        {silent && <Alert color="orange">{t("page.write.silent")}</Alert>}
        <Group justify="flex-end">
          <Button variant="default" onClick={onClose}>
            {t(write.isSuccess ? "page.close" : "page.cancel")}
          </Button>
          <Button
            type="submit"
            disabled={!ready}
            leftSection={<IconSend size={17} aria-hidden />}
            data-testid="write"
          >
            {t(same ? "page.write.again" : "page.write.button")}
          </Button>
        </Group>
      </Stack>
    </form>
  );
}

function textToEdit(entry: EntryDoc, raw: Raw | null, { lookup, t }: ReturnType<typeof useDevice>): string {
  return raw === null ? "" : show(entry, raw, lookup, t.language);
}

/** Why the typed text is refused, the limit named; null while it is fine or nothing was typed yet. */
function refusal(
  parsed: Parsed,
  typed: string,
  entry: EntryDoc,
  context: ReturnType<typeof useDevice>,
): string | null {
  if (parsed.ok || (parsed.why === Misfit.Empty && typed === "")) return null;
  const { unit, decimals, scale } = quantityOf(entry, context.lookup);
  const step = show({ ...entry, hexadecimal: false, bits: null }, 1, context.lookup, context.t.language);
  return context.t(`page.misfit.${parsed.why}`, {
    limits: limitText(entry, context, true),
    unit: isHex(entry) ? "" : unit,
    step: isInteger(entry) && scale.num !== 0n && decimals >= 0 ? step : "",
  });
}

function Preview({ entry, from, to }: { entry: EntryDoc; from: Raw | null; to: Raw }) {
  const context = useDevice();
  if (from === to) return null;
  const line = (raw: Raw | null) => (raw === null ? "–" : lineOf(shownOf(entry, raw, context)));
  return (
    <div className={classes.preview} data-testid="preview">
      <span className="dim">{line(from)}</span>
      <IconArrowRight size={16} aria-hidden />
      <b>{line(to)}</b>
      <span className="dim">{context.t("page.entry.raw_only", { raw: to })}</span>
    </div>
  );
}

/** Sent, then verified. The value itself is shown by the table, from the bus, and never from this answer. */
function Progress({
  entry,
  pending,
  result,
}: {
  entry: EntryDoc;
  pending: boolean;
  result: WriteResult | undefined;
}) {
  const context = useDevice();
  const { t } = context;
  if (pending) return <div role="status">{t("page.write.sent")}</div>;
  if (!result) return null;
  const line = (raw: Raw | null) => (raw === null ? "–" : lineOf(shownOf(entry, raw, context)));
  const details = { sent: line(result.sent_raw), read: line(result.read_raw), was: line(result.was_raw) };
  if (!result.verified) {
    return (
      <Alert color="orange" data-testid="write-unverified" title={t("page.write.unverified", details)}>
        {t("page.next.unverified")}
      </Alert>
    );
  }
  return (
    <Alert
      color="green"
      role="status"
      icon={<IconCircleCheck aria-hidden />}
      title={t("page.write.verified", details)}
      data-testid="write-verified"
    >
      {entry.saved ? t("page.write.not_saved_yet") : t("page.write.not_kept")}
    </Alert>
  );
}
