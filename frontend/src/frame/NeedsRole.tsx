import { Tooltip } from "@mantine/core";
import type { ReactNode } from "react";
import { useTexts } from "../texts/texts";
import { type Role, useRole } from "./role";
import { usePageSearch } from "./search";

interface Props {
  role: Role;
  /** It asks or orders a device: locked as well where a recording is shown. */
  device?: boolean;
  /** Draws the control; `locked` is to be its `disabled`, together with what else disables it. */
  children: (locked: boolean) => ReactNode;
}

/**
 * A control that only some roles may use, and that reaches no device while a recording is shown: for others it is drawn
 * disabled, with the reason in a tooltip that keyboard and pointer reach (a disabled control takes neither).
 */
export function NeedsRole({ role, device = false, children }: Props) {
  const t = useTexts();
  const { why } = useRole();
  const [{ replay }] = usePageSearch(); // also in a room of the present, which stands beside it
  const recorded = replay !== undefined;
  const reason = device && recorded ? t("page.replay.locked") : why(role);
  if (reason === null) return children(false);
  return (
    <Tooltip label={reason}>
      <span
        style={{ display: "inline-block" }}
        tabIndex={0}
        role="note"
        aria-label={reason}
        data-locked={device && recorded ? "replay" : role}
      >
        {children(true)}
      </span>
    </Tooltip>
  );
}
