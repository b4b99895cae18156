/** Short messages to the operator. Good news goes by itself; bad news stays until it is closed. */
import { useSyncExternalStore } from "react";

export interface Notice {
  id: number;
  tone: "ok" | "warning" | "error";
  title: string;
  lines: string[];
  /** What can be done about it right here; such a notice stays until it is closed. */
  action?: { label: string; run: () => void };
}

const SHOWN_MS = 6000;
const MAX_SHOWN = 4;

let notices: readonly Notice[] = [];
let nextId = 1;
const listeners = new Set<() => void>();

function change(to: readonly Notice[]): void {
  notices = to;
  for (const listener of [...listeners]) listener();
}

export function notify(notice: Omit<Notice, "id">): void {
  const id = nextId;
  nextId += 1;
  change([...notices, { ...notice, id }].slice(-MAX_SHOWN));
  if (notice.tone === "ok" && !notice.action) setTimeout(() => dismiss(id), SHOWN_MS);
}

export function dismiss(id: number): void {
  change(notices.filter((notice) => notice.id !== id));
}

function subscribe(listener: () => void): () => void {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

export const useNotices = () => useSyncExternalStore(subscribe, () => notices);
