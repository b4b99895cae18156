import { IconAlertOctagon, IconAlertTriangle, IconChevronDown, IconChevronRight } from "@tabler/icons-react";
import { useId, useState } from "react";
import type { AxisData } from "../../api/types";
import type { DeviceContext } from "../../model/shown";
import { useTexts } from "../../texts/texts";
import { errorCode } from "../../ui/format";
import { ErrorAid } from "./ErrorAid";
import classes from "./Errors.module.css";

interface Props {
  fault: AxisData["faults"][number];
  /** Name of the device. */
  device: string;
  context: DeviceContext;
  partner: DeviceContext | null;
  /** Nothing is heard of the device. */
  silent: boolean;
}

/** What a device complains of now, with first aid: open by itself, before its error memory is read. */
export function ErrorNow({ fault, device, context, partner, silent }: Props) {
  const t = useTexts();
  const id = useId();
  const [open, setOpen] = useState(true);
  const { code, severity, text_key } = fault;
  const Icon = severity === "error" ? IconAlertOctagon : IconAlertTriangle;
  const Chevron = open ? IconChevronDown : IconChevronRight;
  return (
    <div
      className={classes.now}
      data-severity={severity}
      data-stale={silent}
      data-testid={`error-now-${device}`}
    >
      <button
        type="button"
        className={classes.head}
        aria-expanded={open}
        aria-controls={open ? id : undefined}
        title={t(silent ? "page.aid.now_stale" : "page.aid.now_told", { device })}
        onClick={() => setOpen(!open)}
      >
        <Chevron size={16} aria-hidden />
        <span className={classes.mark}>
          <Icon size={17} aria-hidden />
          {t(silent ? "page.aid.last" : "page.aid.now")} · {t(`page.severity.${severity}`)}
        </span>
        <strong>{errorCode(code)}</strong>
        <span>{t(text_key ?? "page.card.unknown_code")}</span>
      </button>
      {open && (
        <div id={id}>
          <ErrorAid code={code} context={context} partner={partner} warning={severity === "warning"} />
        </div>
      )}
    </div>
  );
}
