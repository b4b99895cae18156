import { Button } from "@mantine/core";
import { IconRefresh } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { commands } from "../../api/client";
import type { DescriptionDoc, DeviceRef } from "../../api/types";
import { NeedsRole } from "../../frame/NeedsRole";
import { useDeviceVersion } from "../../live/live";
import type { DeviceContext } from "../../model/shown";
import { type Translate, useTexts } from "../../texts/texts";
import { errorCode } from "../../ui/format";
import { notify } from "../../ui/notices";
import { storyOf } from "../../ui/problem";
import { useUnheard } from "../../ui/reading";
import classes from "./Axis.module.css";

const ENTRIES = [1, 2, 3, 4, 5, 6, 7, 8];
/** Sub-index 0: the number of entries. */
const COUNT = "1003";
const entryOf = (at: number) => `1003:0${at}`;
const stampOf = (at: number) => `2030:0${at}`;
const LOW_WORD = 0x10000;

interface Props {
  device: DeviceRef | undefined;
  context: DeviceContext | null;
}

/** The error memory of a device (1003h), newest first, with what each code means and what the device does about it. */
export function ErrorHistory({ device, context }: Props) {
  const t = useTexts();
  const slug = device?.slug ?? "";
  useDeviceVersion(slug);
  const silent = useUnheard(slug);
  const read = useMutation({
    mutationFn: () => commands.read(slug, [COUNT, ...ENTRIES.flatMap((at) => [entryOf(at), stampOf(at)])]),
    onError: (error) => {
      const story = storyOf(error, t);
      notify({ tone: "error", title: t("page.read.failed"), lines: [story.happened, story.next] });
    },
  });
  if (!device || !context) return null;
  const count = context.lookup(COUNT);
  const title = t("page.axis.history", { device: device.name });
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
              onClick={() => read.mutate()}
            >
              {t("page.read.now")}
            </Button>
          )}
        </NeedsRole>
      </h2>
      {typeof count !== "number" && <p className="dim">{t("page.axis.history_unknown")}</p>}
      {count === 0 && <p>{t("page.axis.history_empty")}</p>}
      {typeof count === "number" && count > 0 && <Entries context={context} count={count} />}
    </section>
  );
}

function Entries({ context, count }: { context: DeviceContext; count: number }) {
  const t = useTexts();
  const { doc, lookup } = context;
  return (
    <table className={classes.history}>
      <thead>
        <tr>
          <th>{t("page.axis.code")}</th>
          <th>{t("page.axis.meaning")}</th>
          <th>{t("page.axis.reaction")}</th>
          <th title={t("page.axis.stamp_title")}>{t("page.axis.stamp")}</th>
        </tr>
      </thead>
      <tbody>
        {ENTRIES.slice(0, count).map((at) => {
          const raw = lookup(entryOf(at));
          const stamp = lookup(stampOf(at));
          const code = typeof raw === "number" ? raw % LOW_WORD : null;
          return (
            <tr key={at}>
              <td title={raw === null ? "" : t("page.entry.raw_only", { raw })}>
                <strong>{code === null ? "–" : errorCode(code)}</strong>
              </td>
              <td>{code === null ? t("page.axis.entry_unread") : meaningOf(doc, code, t)}</td>
              <td>{code === null ? "–" : reactionOf(doc, code, t)}</td>
              <td>{stamp ?? "–"}</td>
            </tr>
          );
        })}
      </tbody>
    </table>
  );
}

function meaningOf(doc: DescriptionDoc, code: number, t: Translate): string {
  const error = doc.errors.find((one) => one.code === code);
  return t(error ? error.text_key : "page.card.unknown_code");
}

function reactionOf(doc: DescriptionDoc, code: number, t: Translate): string {
  const reaction = doc.errors.find((one) => one.code === code)?.reaction ?? null;
  return reaction === null ? "–" : t(`reaction.${reaction}`);
}
