import { Button } from "@mantine/core";
import { IconEyeOff, IconRefresh } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { commands } from "../../../api/client";
import { NeedsRole } from "../../../frame/NeedsRole";
import { useTexts } from "../../../texts/texts";
import { notify } from "../../../ui/notices";
import { storyOf } from "../../../ui/problem";
import { useDeviceName } from "../../../ui/devices";
import type { Compared } from "./compared";
import classes from "./Compare.module.css";

/** Values of connected devices that nobody has read yet, and the way to have them. */
export function Unread({ compared }: { compared: Compared }) {
  const t = useTexts();
  const nameOf = useDeviceName();
  const { columns, rows } = compared.doc;
  const gaps = columns.flatMap(({ kind, device }, at) => {
    if (kind !== "live" && kind !== "editor") return [];
    const addresses = rows.filter((row) => row.cells[at]?.state === "unread").map((row) => row.address);
    return addresses.length === 0 ? [] : [{ device, addresses }];
  });
  const read = useMutation({
    mutationFn: () => Promise.all(gaps.map(({ device, addresses }) => commands.read(device, addresses))),
    onError: (error) => {
      const story = storyOf(error, t);
      notify({ tone: "error", title: t("page.compare.read_failed"), lines: [story.happened, story.next] });
    },
  });
  if (gaps.length === 0) return null;
  return (
    <div className={classes.note} role="status" data-testid="compare-unread">
      <IconEyeOff size={18} aria-hidden />
      <ul>
        {gaps.map(({ device, addresses }) => (
          <li key={device}>
            {t("page.compare.unread", { device: nameOf(device), count: addresses.length })}
          </li>
        ))}
      </ul>
      <span className={classes.spacer} />
      <NeedsRole role="technician" device>
        {(locked) => (
          <Button
            px="sm"
            variant="default"
            leftSection={<IconRefresh size={17} aria-hidden />}
            disabled={locked}
            loading={read.isPending}
            onClick={() => read.mutate()}
            data-testid="compare-read"
          >
            {t("page.compare.read")}
          </Button>
        )}
      </NeedsRole>
    </div>
  );
}
