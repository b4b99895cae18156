import { type KeyboardEvent, type PointerEvent, type ReactNode, useEffect, useRef } from "react";
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

/** A finger that slips so far from where it pressed does not mean this button any more. */
const SLIP_PX = 60;

const isRunKey = (event: KeyboardEvent) => event.key === "Enter" || event.key === " ";

/**
 * Hold to run: what it commands goes on exactly as long as it is pressed, by pointer, Enter or Space. What counts is where
 * the pointer goes, not the button: that may move when a line above it changes.
 */
export function RunButton({ children, hint, disabled, active, onPress, testId }: Props) {
  const pressedAt = useRef({ x: 0, y: 0 });
  // Another button that was pressed before loses the focus only now: it has nothing to let go.
  const pressed = useRef(false);
  const letGo = () => {
    if (!pressed.current) return;
    pressed.current = false;
    holding.letGo();
  };
  // A button that goes away under the finger lets go too.
  useEffect(() => letGo, []);
  const press = () => {
    if (disabled || holding.holding) return;
    pressed.current = true;
    onPress();
  };
  return (
    <button
      type="button"
      className={classes.run}
      data-active={active}
      data-testid={testId}
      aria-disabled={disabled}
      onPointerDown={(event: PointerEvent) => {
        if (event.button !== 0) return;
        event.currentTarget.setPointerCapture(event.pointerId);
        pressedAt.current = { x: event.clientX, y: event.clientY };
        press();
      }}
      onPointerMove={(event: PointerEvent) => {
        const { x, y } = pressedAt.current;
        // With another button down the release of this one is told as a move.
        const released = (event.buttons & 1) === 0;
        if (released || Math.hypot(event.clientX - x, event.clientY - y) > SLIP_PX) letGo();
      }}
      onPointerUp={letGo}
      onPointerCancel={letGo}
      onLostPointerCapture={letGo}
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
