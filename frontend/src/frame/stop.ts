/** STOP and FEATHER: sent at once, to every axis; "sent" until the drive confirms. */
import { useMutation } from "@tanstack/react-query";
import { useEffect } from "react";
import type { StopResult } from "../api/types";
import { liveStore, sendUrgent } from "../live/live";
import { mayMove } from "../live/axis";
import { type Translate, useTexts } from "../texts/texts";
import { useDeviceName } from "../ui/devices";
import { notify } from "../ui/notices";
import { storyOf } from "../ui/problem";

export enum Halt {
  Stop = "stop",
  Feather = "feather",
}

export function useHalt(halt: Halt) {
  const t = useTexts();
  const nameOf = useDeviceName();
  return useMutation({
    mutationFn: () => sendUrgent({ command: halt }),
    onSuccess: (result) => {
      const confirmed = result.axes.length > 0 && result.axes.every((axis) => axis.confirmed_t_ns !== null);
      const failed = result.axes.some((axis) => axis.how === "failed");
      notify({
        tone: confirmed ? "ok" : failed ? "error" : "warning",
        title: t(`page.${halt}.${confirmed ? "confirmed" : "unconfirmed"}`),
        lines: haltLines(halt, result, t, nameOf),
      });
    },
    onError: (error) => {
      const story = storyOf(error, t);
      notify({
        tone: "error",
        title: t(`page.${halt}.failed`),
        lines: [story.happened, t("page.stop.use_hardware")],
      });
    },
  });
}

function haltLines(halt: Halt, result: StopResult, t: Translate, nameOf: (slug: string) => string): string[] {
  return result.axes.map((axis) => {
    const device = nameOf(axis.device);
    if (axis.how === "failed") return t("page.stop.axis_failed", { device });
    if (axis.how === "replaced") return t("page.stop.axis_replaced", { device });
    if (axis.confirmed_t_ns === null) return t("page.stop.axis_sent", { device });
    const ms = Math.round((axis.confirmed_t_ns - axis.sent_t_ns) / 1e6);
    return t(`page.${halt}.axis_confirmed`, { device, ms });
  });
}

type StopRequest = () => void;
let stopNow: StopRequest | null = null;

/** Gives the Esc key what it does; the returned function takes it back. */
export function lendStop(stop: StopRequest): () => void {
  stopNow = stop;
  return () => {
    stopNow = null;
  };
}

/** The STOP button lends its action to the Esc key. */
export function useLendStop(stop: StopRequest): void {
  useEffect(() => lendStop(stop), [stop]);
}

/** True unless it is known that nothing can move: a lost bus need not be the only one, and who is deaf knows nothing. */
function anythingMayMove(): boolean {
  const { link, motion, axes, hearing } = liveStore;
  if (!link || link.state === "disconnected") return false;
  if (motion?.running) return true;
  if (link.state === "lost" || hearing.state === "deaf") return axes.size > 0 || motion?.available === true;
  return mayMove(axes.values());
}

/** While anything can move, Esc is STOP and nothing else. Taken in the capture phase, before any dialog sees it. */
export function stopOnEscape(event: KeyboardEvent): void {
  if (event.key !== "Escape" || !anythingMayMove()) return;
  event.preventDefault();
  event.stopImmediatePropagation();
  if (!event.repeat) stopNow?.();
}

export function useEscapeStops(): void {
  useEffect(() => {
    window.addEventListener("keydown", stopOnEscape, { capture: true });
    return () => window.removeEventListener("keydown", stopOnEscape, { capture: true });
  }, []);
}
