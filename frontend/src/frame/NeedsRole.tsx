import { Tooltip } from "@mantine/core";
import type { ReactNode } from "react";
import { type Role, useRole } from "./role";

interface Props {
  role: Role;
  /** Draws the control; `locked` is to be its `disabled`, together with what else disables it. */
  children: (locked: boolean) => ReactNode;
}

/**
 * A control that only some roles may use: for others it is drawn disabled, with the reason in a tooltip that keyboard
 * and pointer reach (a disabled control takes neither).
 */
export function NeedsRole({ role, children }: Props) {
  const { why } = useRole();
  const reason = why(role);
  if (reason === null) return children(false);
  return (
    <Tooltip label={reason}>
      <span
        style={{ display: "inline-block" }}
        tabIndex={0}
        role="note"
        aria-label={reason}
        data-locked={role}
      >
        {children(true)}
      </span>
    </Tooltip>
  );
}
