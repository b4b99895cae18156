import { Button } from "@mantine/core";
import { IconChevronDown, IconChevronRight, IconRefresh } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useId, useState } from "react";
import { commands } from "../../api/client";
import type { AxisData, DescriptionDoc, DeviceRef } from "../../api/types";
import { NeedsRole } from "../../frame/NeedsRole";
import { useDerived } from "../../live/live";
import type { DeviceContext } from "../../model/shown";
import { type Translate, useTexts } from "../../texts/texts";
import { errorCode } from "../../ui/format";
import { notify } from "../../ui/notices";
import { storyOf } from "../../ui/problem";
import { entriesOf, useUnheard } from "../../ui/reading";
import classes from "./Axis.module.css";
import { ErrorAid, FAULT_REACTION } from "./ErrorAid";
import { ErrorNow } from "./ErrorNow";
import own from "./Errors.module.css";
import { errorIn, MEMORY, STAMP, type MemoryEntry, memoryOf } from "./errorMemory";

interface Props {
  device: DeviceRef | undefined;
  context: DeviceContext | null;
  /** The other device of the station. */
  partner: DeviceContext | null;
  /** What the devices of the blade complain of now. */
  faults: AxisData["faults"];
}

/**
 * What a device complains of now (603Fh) and its error memory (1003h), newest first: what each code means, why it came,
 * what the device does about it, and what to do first.
 */
export function ErrorHistory({ device, context, partner, faults }: Props) {
  const t = useTexts();
  const slug = device?.slug ?? "";
  const entries = useDerived([`device:${slug}`], () => context && memoryOf(context.lookup));
  const silent = useUnheard(slug);
  const read = useMutation({
    mutationFn: (addresses: string[]) => commands.read(slug, addresses),
    onError: (error) => {
      const story = storyOf(error, t);
      notify({ tone: "error", title: t("page.read.failed"), lines: [story.happened, story.next] });
    },
  });
  if (!device || !context) return null;
  const fault = faults.find((one) => one.device === slug);
  const title = t("page.axis.history", { device: device.name });
  // What the drive would do belongs to what the memory tells.
  const wanted = [...MEMORY, FAULT_REACTION].filter((address) => entriesOf(context.doc).has(address));
  return (
    <section
      className={`${classes.panel} ${classes.wide}`}
      aria-label={title}
      data-testid={`history-${device.name}`}
    >
      <h2>
        {title}
        <NeedsRole role="technician" device>
          {(locked) => (
            <Button
              variant="default"
              size="xs"
              h={40}
              disabled={locked || silent}
              loading={read.isPending}
              leftSection={<IconRefresh size={16} aria-hidden />}
              onClick={() => read.mutate(wanted)}
            >
              {t("page.read.now")}
            </Button>
          )}
        </NeedsRole>
      </h2>
      {fault && (
        <ErrorNow
          key={fault.code}
          fault={fault}
          device={device.name}
          context={context}
          partner={partner}
          silent={silent}
        />
      )}
      {entries === null && <p className="dim">{t("page.axis.history_unknown")}</p>}
      {entries?.length === 0 && <p>{t("page.axis.history_empty")}</p>}
      {entries !== null && entries.length > 0 && (
        <Entries entries={entries} context={context} partner={partner} now={fault?.code ?? null} />
      )}
    </section>
  );
}

interface EntriesProps {
  entries: MemoryEntry[];
  context: DeviceContext;
  partner: DeviceContext | null;
  /** The code that stands open above. */
  now: number | null;
}

function Entries({ entries, context, partner, now }: EntriesProps) {
  const t = useTexts();
  const stamped = entriesOf(context.doc).has(STAMP);
  const [chosen, setChosen] = useState<Record<string, boolean>>({});
  // The newest is open by itself, but nothing is told twice.
  const isOpen = ({ key, at, code }: MemoryEntry) => chosen[key] ?? (at === 1 && code !== now);
  return (
    <table className={classes.history}>
      <thead>
        <tr>
          <th>{t("page.axis.code")}</th>
          <th>{t("page.axis.meaning")}</th>
          <th>{t("page.axis.reaction")}</th>
          {stamped && <th title={t("page.axis.stamp_title")}>{t("page.axis.stamp")}</th>}
        </tr>
      </thead>
      {entries.map((entry) => (
        <EntryRows
          key={entry.key}
          entry={entry}
          context={context}
          partner={partner}
          open={isOpen(entry)}
          stamped={stamped}
          onToggle={() => setChosen({ ...chosen, [entry.key]: !isOpen(entry) })}
        />
      ))}
    </table>
  );
}

interface EntryProps {
  entry: MemoryEntry;
  context: DeviceContext;
  partner: DeviceContext | null;
  open: boolean;
  stamped: boolean;
  onToggle: () => void;
}

function EntryRows({ entry, context, partner, open, stamped, onToggle }: EntryProps) {
  const t = useTexts();
  const id = useId();
  const { code, raw, at } = entry;
  const shown = open && code !== null;
  const Chevron = shown ? IconChevronDown : IconChevronRight;
  return (
    <tbody data-testid={`error-${at}`}>
      {/* A click anywhere in the row, for gloves; that of the button, also by key, comes up to here. */}
      <tr className={own.entry} onClick={code === null ? undefined : onToggle}>
        <td>
          {code === null ? (
            <strong>–</strong>
          ) : (
            <button
              type="button"
              className={own.toggle}
              aria-expanded={shown}
              aria-controls={shown ? id : undefined}
              aria-label={t("page.aid.toggle", { code: errorCode(code) })}
              title={t("page.entry.raw_only", { raw })}
            >
              <Chevron size={16} aria-hidden />
              {errorCode(code)}
            </button>
          )}
        </td>
        <td>{code === null ? t("page.axis.entry_unread") : meaningOf(context.doc, code, t)}</td>
        <td>{code === null ? "–" : reactionOf(context.doc, code, t)}</td>
        {stamped && <td>{entry.stamp ?? "–"}</td>}
      </tr>
      {shown && (
        <tr id={id} className={own.more}>
          <td colSpan={stamped ? 4 : 3}>
            <ErrorAid code={code} context={context} partner={partner} />
          </td>
        </tr>
      )}
    </tbody>
  );
}

function meaningOf(doc: DescriptionDoc, code: number, t: Translate): string {
  return t(errorIn(doc, code)?.text_key ?? "page.card.unknown_code");
}

function reactionOf(doc: DescriptionDoc, code: number, t: Translate): string {
  const reaction = errorIn(doc, code)?.reaction ?? null;
  return reaction === null ? "–" : t(`reaction.${reaction}`);
}
