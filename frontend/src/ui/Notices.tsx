import { Button, Notification } from "@mantine/core";
import { IconAlertTriangle, IconCheck, IconX } from "@tabler/icons-react";
import { useTexts } from "../texts/texts";
import classes from "./Notices.module.css";
import { dismiss, type Notice, useNotices } from "./notices";

const LOOKS = {
  ok: { color: "green.9", Icon: IconCheck },
  warning: { color: "yellow.9", Icon: IconAlertTriangle },
  error: { color: "red.8", Icon: IconX },
};

export function Notices() {
  const t = useTexts();
  return (
    <section className={classes.stack} aria-label={t("page.notices.label")} aria-live="assertive">
      {useNotices().map((notice) => (
        <One key={notice.id} notice={notice} close={t("page.close")} />
      ))}
    </section>
  );
}

function One({ notice, close }: { notice: Notice; close: string }) {
  const { color, Icon } = LOOKS[notice.tone];
  return (
    <Notification
      role={notice.tone === "ok" ? "status" : "alert"}
      color={color}
      icon={<Icon size={18} aria-hidden />}
      title={notice.title}
      withBorder
      onClose={() => dismiss(notice.id)}
      closeButtonProps={{ "aria-label": close, size: 40 }}
    >
      {notice.lines.map((line) => (
        <div key={line}>{line}</div>
      ))}
      {notice.action && (
        <Button variant="default" mt={6} onClick={notice.action.run} data-testid="notice-action">
          {notice.action.label}
        </Button>
      )}
    </Notification>
  );
}
