import { type KeyboardEvent, type PointerEvent, type ReactNode, useEffect } from "react";
import classes from "./Motion.module.css";
import { holding } from "./lease";

interface Props {
  children: ReactNode;
  /** Says in words that it must be held. */
  hint: string;
  disabled: boolean;
  /** What it has the axis do is under way. */
  active: boolean;
  onPress: () => void;
  testId: string;
}

const isRunKey = (event: KeyboardEvent) => event.key === "Enter" || event.key === " ";

/** Hold to run: what it commands goes on exactly as long as it is pressed, by pointer, Enter or Space. */
export function RunButton({ children, hint, disabled, active, onPress, testId }: Props) {
  const letGo = () => holding.letGo();
  // A button that goes away under the finger lets go too.
  useEffect(() => letGo, []);
  const press = () => {
    if (!disabled && !holding.holding) onPress();
  };
  return (
    <button
      type="button"
      className={classes.run}
      data-active={active}
      data-testid={testId}
      aria-disabled={disabled}
      onPointerDown={(event: PointerEvent) => {
        if (event.button === 0) press();
      }}
      onPointerUp={letGo}
      onPointerLeave={letGo}
      onPointerCancel={letGo}
      onBlur={letGo}
      onContextMenu={(event) => event.preventDefault()}
      onKeyDown={(event) => {
        if (!isRunKey(event)) return;
        event.preventDefault();
        if (!event.repeat) press();
      }}
      onKeyUp={letGo}
    >
      {children}
      <small>{hint}</small>
    </button>
  );
}
