import { PAGE } from "../live/page";
/** The lease as this page has it: taken, asked for, given back; one for all rooms of the page. */
import { useMutation } from "@tanstack/react-query";
import { useEffect } from "react";
import { moving } from "../api/motion";
import type { MotionData } from "../api/types";
import { liveStore, sendBeat, useHearing, useMotion, useMotionMark } from "../live/live";
import { Holding } from "./holding";

export { PAGE };

export const holding = new Holding(PAGE, sendBeat);

export enum Control {
  /** Nothing is connected that could move. */
  None = "none",
  Free = "free",
  Own = "own",
  Others = "others",
}

function controlOf(motion: MotionData | null): Control {
  if (motion?.available !== true) return Control.None;
  if (motion.holder === null) return Control.Free;
  return motion.holder.page === PAGE ? Control.Own : Control.Others;
}

/** How control of the axes stands for this page. */
export function useControl() {
  const motion = useMotion();
  const state = controlOf(motion);
  return {
    motion,
    state,
    asking: motion?.wish?.page === PAGE,
    refused: motion?.refused === PAGE,
    asked: state === Control.Own ? (motion?.wish ?? null) : null,
  };
}

/** Keeps the number of the lease in step with what the bench says; for one place of the page. */
export function useKeepLease(): void {
  const state = useMotionMark(controlOf);
  const fence = useMotionMark((motion) => (motion?.holder?.page === PAGE ? motion.holder.until_ns : null));
  const deaf = useHearing().state === "deaf";
  useEffect(() => {
    if (state !== Control.Own || deaf) holding.own(null);
    else if (holding.fence === null)
      void moving.take(PAGE).then(
        (lease) => holding.own(lease.fence),
        () => undefined, // what became of it comes over the socket
      );
  }, [state, deaf, fence]);
  useEffect(() => {
    const letGo = () => holding.letGo();
    window.addEventListener("blur", letGo);
    document.addEventListener("visibilitychange", letGo);
    return () => {
      window.removeEventListener("blur", letGo);
      document.removeEventListener("visibilitychange", letGo);
    };
  }, []);
}

export interface Looked {
  rotorLocked: boolean;
  peopleOut: boolean;
  /** Devices whose stop by hand an expert answers for. */
  externalStops: readonly string[];
}

const told = (line: MotionData) => liveStore.takeMotion(line);

export function useLeaseActions() {
  const owned = (lease: { fence: number | null }) => {
    if (lease.fence !== null) holding.own(lease.fence);
  };
  return {
    take: useMutation({ mutationFn: () => moving.take(PAGE), onSuccess: owned }),
    ask: useMutation({ mutationFn: () => moving.ask(PAGE), onSuccess: owned }),
    withdraw: useMutation({ mutationFn: () => moving.withdraw(PAGE), onSuccess: told }),
    giveBack: useMutation({
      mutationFn: () => moving.giveBack(holding.fence ?? 0),
      onSuccess: (line) => {
        holding.own(null);
        told(line);
      },
    }),
    answer: useMutation({
      mutationFn: (handOver: boolean) => moving.answer(holding.fence ?? 0, handOver),
      onSuccess: told,
    }),
    confirm: useMutation({
      mutationFn: (looked: Looked) =>
        moving.confirm(holding.fence ?? 0, looked.rotorLocked, looked.peopleOut, looked.externalStops),
      onSuccess: told,
    }),
  };
}
