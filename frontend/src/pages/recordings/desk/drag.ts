/** Signals that are dragged from the tree into a plot. */
import { type DragEvent, useState } from "react";

const KIND = "application/x-hubside-signal";

export function startDrag(event: DragEvent, signal: string): void {
  event.dataTransfer.setData(KIND, signal);
  event.dataTransfer.setData("text/plain", signal);
  event.dataTransfer.effectAllowed = "copy";
}

/** What an element needs to take signals; `over` while one hangs above it. */
export function useDrop(onSignal: (signal: string) => void) {
  const [over, setOver] = useState(false);
  const carries = (event: DragEvent) => event.dataTransfer.types.includes(KIND);
  const handlers = {
    onDragOver: (event: DragEvent) => {
      if (!carries(event)) return;
      event.preventDefault();
      event.dataTransfer.dropEffect = "copy";
      setOver(true);
    },
    onDragLeave: (event: DragEvent) => {
      const { relatedTarget, currentTarget } = event;
      if (!(relatedTarget instanceof Node && currentTarget.contains(relatedTarget))) setOver(false);
    },
    onDrop: (event: DragEvent) => {
      setOver(false);
      const signal = event.dataTransfer.getData(KIND);
      if (signal === "") return;
      event.preventDefault();
      onSignal(signal);
    },
  };
  return { over, handlers };
}
