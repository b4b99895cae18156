/** The one live store and socket of the page, and the hooks by which components see them. */
import { useCallback, useEffect, useState, useSyncExternalStore } from "react";
import type { TraceFilter } from "../api/trace";
import { FrameStore, type TraceView } from "./frames";
import { LiveSocket } from "./socket";
import { type Cell, LiveStore } from "./store";

const HIDDEN_TICK_MS = 250;

/** An animation frame; a hidden page has none, so a slow timer then. */
function schedule(flush: () => void): void {
  if (document.hidden) setTimeout(flush, HIDDEN_TICK_MS);
  else requestAnimationFrame(flush);
}

export const store = new LiveStore(schedule, () => Date.now());
export const frames = new FrameStore(schedule);

let socket: LiveSocket | null = null;

export function startLive(): void {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  socket ??= new LiveSocket(`${scheme}://${location.host}/api/ws`, store, frames);
}

function useTopic<T>(topic: string, read: () => T): T {
  const subscribe = useCallback((listener: () => void) => store.subscribe(topic, listener), [topic]);
  return useSyncExternalStore(subscribe, read);
}

export const useHearing = () => useTopic("hearing", () => store.hearing);
export const useBench = () => useTopic("bench", () => store.bench);
export const useLink = () => useTopic("link", () => store.link);
export const useNodes = () => useTopic("nodes", () => store.nodes);
export const useAxes = () => useTopic("axes", () => store.axes);
export const useRotor = () => useTopic("rotor", () => store.rotor);
export const useInstructor = () => useTopic("instructor", () => store.instructor);
export const useEvents = () => useTopic("events", () => store.events);
export const useLoadHistory = () => useTopic("link", () => store.loadHistory);

export function useCell(device: string, address: string): Cell | undefined {
  return useTopic(`value:${device}/${address}`, () => store.cell(device, address));
}

/** Raised with every message of values of the device. */
export function useDeviceVersion(device: string): number {
  return useTopic(`device:${device}`, () => store.version(device));
}

/** Keeps the values of the device coming while the component is there. */
export function useWatchDevice(slug: string | null): void {
  useEffect(() => (slug === null ? undefined : socket?.watchDevice(slug)), [slug]);
}

/** The rows of the trace that the page keeps. */
export const useFrames = (): TraceView => useSyncExternalStore(frames.subscribe, () => frames.view);

/** Has the running trace come with this number while it is called for. */
export function watchTrace(filter: TraceFilter, id: number): () => void {
  return socket?.watchTrace({ ...filter, id }) ?? (() => undefined);
}

/** The server's clock, ms, renewed every `everyMs`: for ages and running clocks. */
export function useServerNow(everyMs: number): number {
  const [now, setNow] = useState(() => store.serverNowMs());
  useEffect(() => {
    const timer = setInterval(() => setNow(store.serverNowMs()), everyMs);
    return () => clearInterval(timer);
  }, [everyMs]);
  return now;
}
