import { type KeyboardEvent, type PointerEvent, type ReactNode, useEffect, useRef, useState } from "react";
import classes from "./HoldButton.module.css";

const HOLD_MS = 1200;

interface Props {
  children: ReactNode;
  /** Says in words that it must be held. */
  hint: string;
  tone: "accent" | "danger";
  disabled?: boolean;
  onHeld: () => void;
  testId?: string;
}

/** A button that acts only after it was held down for a while, by pointer, Enter or Space; letting go cancels. */
export function HoldButton({ children, hint, tone, disabled = false, onHeld, testId }: Props) {
  const [holding, setHolding] = useState(false);
  const timer = useRef<ReturnType<typeof setTimeout> | null>(null);

  const cancel = () => {
    if (timer.current !== null) clearTimeout(timer.current);
    timer.current = null;
    setHolding(false);
  };
  const begin = () => {
    if (disabled || timer.current !== null) return;
    setHolding(true);
    timer.current = setTimeout(() => {
      cancel();
      onHeld();
    }, HOLD_MS);
  };
  useEffect(
    () => () => {
      if (timer.current !== null) clearTimeout(timer.current);
    },
    [],
  );

  const isHoldKey = (event: KeyboardEvent) => event.key === "Enter" || event.key === " ";
  return (
    <button
      type="button"
      className={classes.hold}
      data-tone={tone}
      data-holding={holding}
      data-testid={testId}
      disabled={disabled}
      style={{ "--hold-ms": `${HOLD_MS}ms` } as React.CSSProperties}
      onPointerDown={(event: PointerEvent) => {
        if (event.button === 0) begin();
      }}
      onPointerUp={cancel}
      onPointerLeave={cancel}
      onPointerCancel={cancel}
      onBlur={cancel}
      onContextMenu={(event) => event.preventDefault()}
      onKeyDown={(event) => {
        if (!isHoldKey(event)) return;
        event.preventDefault();
        if (!event.repeat) begin();
      }}
      onKeyUp={cancel}
    >
      <span className={classes.fill} aria-hidden />
      <span className={classes.text}>
        {children}
        <small>{hint}</small>
      </span>
    </button>
  );
}
