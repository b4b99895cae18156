/**
 * The channels and the one socket of the page, and the hooks by which components see what is shown.
 *
 * The hooks read what is shown where they stand: the bench, or in the rooms of a replay the recording at its cursor. What
 * is said of the bench whatever is shown (hearing, STOP, the top bar) stands outside of these rooms, or is named "Live".
 */
import {
  createContext,
  startTransition,
  useCallback,
  useContext,
  useEffect,
  useEffectEvent,
  useMemo,
  useReducer,
  useState,
  useSyncExternalStore,
} from "react";
import type { TraceFilter } from "../api/trace";
import type { AxisData, LinkData, Mode, MotionData, StopResult } from "../api/types";
import { alike, Kept } from "./alike";
import { mayMove } from "./axis";
import { Channel, contextOf, LIVE } from "./channel";
import { every } from "./clock";
import type { TraceView } from "./frames";
import { paced } from "./pace";
import { type Beat, LiveSocket, type Urgent } from "./socket";
import type { Cell, LiveStore } from "./store";
import { commandBy } from "./urgent";

export const live = new Channel(LIVE, paced);

/** What is known of the bench, whatever the page shows. */
export const liveStore = live.store;

let socket: LiveSocket | null = null;

export function startLive(): void {
  started();
}

function started(): LiveSocket {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  return (socket ??= new LiveSocket(`${scheme}://${location.host}/api/ws`, live));
}

/** Say that this page holds an axis, or that it does not; false where the socket is not open. */
export function sendBeat(beat: Beat): boolean {
  return socket?.beat(beat) ?? false;
}

/** STOP or FEATHER, by the quickest way there is. */
export function sendUrgent(urgent: Urgent): Promise<StopResult> {
  return commandBy((one) => started().command(one), urgent);
}

/** A channel for a recording, or the bench's where none is named. */
export function useChannel(replay: string | undefined): Channel {
  return useMemo(() => (replay === undefined ? live : new Channel(contextOf(replay), paced)), [replay]);
}

/** Hear of a channel while it is called for; the answer ends it. */
export function openChannel(channel: Channel, gone: () => void): () => void {
  return socket?.open(channel, gone) ?? (() => undefined);
}

/** What the components below show. */
export const ShownContext = createContext<Channel>(live);

export const useShown = (): Channel => useContext(ShownContext);
export const useStore = (): LiveStore => useShown().store;

function useTopicOf<T>(store: LiveStore, topic: string, read: (store: LiveStore) => T): T {
  const subscribe = useCallback((listener: () => void) => store.subscribe(topic, listener), [store, topic]);
  return useSyncExternalStore(subscribe, () => read(store));
}

const useTopic = <T>(topic: string, read: (store: LiveStore) => T): T => useTopicOf(useStore(), topic, read);

interface Watching<T> {
  /** Also looked at as time goes on. */
  everyMs?: number;
  /** What is alike is not shown anew; by itself `alike`. */
  same?: (one: T, other: T) => boolean;
}

/**
 * What is worked out of the store, looked at whenever one of the topics changes, and shown anew only where it has become
 * another one. In no hurry: a key that is pressed meanwhile comes first, in the midst of many values too.
 */
export const useDerived = <T>(
  topics: readonly string[],
  read: (store: LiveStore) => T,
  watching?: Watching<T>,
): T => useDerivedOf(useShown(), topics, read, watching);

function useDerivedOf<T>(
  shown: Channel,
  topics: readonly string[],
  read: (store: LiveStore) => T,
  { everyMs, same = alike }: Watching<T> = {},
): T {
  const [, renew] = useReducer((count: number) => count + 1, 0);
  const [kept] = useState(() => new Kept<T>());
  const look = useEffectEvent(() => {
    if (!kept.shows(read(shown.store), same)) startTransition(renew);
  });
  const named = topics.join("\n");
  useEffect(() => {
    const listener = () => look();
    const ends = named === "" ? [] : named.split("\n").map((topic) => shown.store.subscribe(topic, listener));
    if (everyMs !== undefined) ends.push(asTimeGoes(shown, everyMs, listener));
    listener(); // something may have come between the first rendering and now
    return () => {
      for (const end of ends) end();
    };
  }, [shown, named, everyMs]);
  return kept.take(read(shown.store), same);
}

/** Calls `look` every `everyMs`, and when a cursor is set elsewhere; the answer ends it. */
function asTimeGoes({ store, recorded }: Channel, everyMs: number, look: () => void): () => void {
  const standing = () => {
    if (store.cursor?.playing !== true) look();
  };
  const ends = [every(everyMs, look)];
  if (recorded) ends.push(store.subscribe("bench", look), store.subscribe("cursor", standing));
  return () => {
    for (const end of ends) end();
  };
}

/** Whether the page hears the bench: one socket brings everything. */
export const useHearing = () => useTopicOf(liveStore, "hearing", (store) => store.hearing);
/** What the bench is, "none" while it is not connected. */
export const useLiveMode = (): Mode =>
  useTopicOf(liveStore, "link", ({ link }) => (link?.state === "connected" ? link.mode : "none"));
export const useLiveLink = () => useTopicOf(liveStore, "link", (store) => store.link);
export const useLiveInstructor = () => useTopicOf(liveStore, "instructor", (store) => store.instructor);
/** Whether any axis of the bench may move. In a hurry, as it says what Esc is. */
export const useMayMove = () => useTopicOf(liveStore, "axes", (store) => mayMove(store.axes.values()));
/** Who may move the axes; always of the bench. */
export const useMotion = () => useDerivedOf(live, ["motion"], (store) => store.motion);
/** One mark of it, in a hurry. */
export const useMotionMark = <T extends string | number | boolean | null>(
  pick: (motion: MotionData | null) => T,
): T => useTopicOf(liveStore, "motion", (store) => pick(store.motion));
export const useLiveBench = () => useTopicOf(liveStore, "bench", (store) => store.bench);

export const useBench = () => useTopic("bench", (store) => store.bench);
export const useLink = () => useTopic("link", (store) => store.link);
/** What is worked out of the link; its figures change every second. */
export const useOfLink = <T>(pick: (link: LinkData | null) => T): T =>
  useDerived(["link"], (store) => pick(store.link));
export const useNodes = () => useTopic("nodes", (store) => store.nodes);
export const useAxes = () => useTopic("axes", (store) => store.axes);
/** What is worked out of one blade's axis; undefined where nothing is known of it. */
export const useAxis = <T>(blade: number, pick: (axis: AxisData | undefined) => T): T =>
  useDerived(["axes"], (store) => pick(store.axes.get(blade)));
export const useRotor = () => useTopic("rotor", (store) => store.rotor);
export const useCylinders = () => useTopic("cylinders", (store) => store.cylinders);
export const useInstructor = () => useTopic("instructor", (store) => store.instructor);
export const useEvents = () => useTopic("events", (store) => store.events);
export const useLoadHistory = () => useTopic("link", (store) => store.loadHistory);
/** The place of a cursor that stands still, in ns; null while time goes on. */
export const useStanding = () =>
  useTopic("cursor", ({ cursor }) => (cursor === null || cursor.playing ? null : cursor.t_ns));
/** Where the recording stands; null for the bench. */
export const useCursor = () => useTopic("cursor", (store) => store.cursor);

export function useCell(device: string, address: string): Cell | undefined {
  return useTopic(`value:${device}/${address}`, (store) => store.cell(device, address));
}

/** Raised with every message of values of the device. */
export function useDeviceVersion(device: string): number {
  return useTopic(`device:${device}`, (store) => store.version(device));
}

/** Keeps the values of the device coming while the component is there. */
export function useWatchDevice(slug: string | null): void {
  const shown = useShown();
  useEffect(() => (slug === null ? undefined : shown.watchDevice(slug)), [shown, slug]);
}

/** The rows of the trace that the page keeps. */
export function useFrames(): TraceView {
  const { frames } = useShown();
  return useSyncExternalStore(frames.subscribe, () => frames.view);
}

/** Has the running trace come with this number while it is called for. */
export function watchTrace(channel: Channel, filter: TraceFilter, id: number): () => void {
  return channel.watchTrace({ ...filter, id });
}

/** What is now, ms, renewed every `everyMs`: for ages and running clocks. A cursor that is set elsewhere is seen at once. */
export function useServerNow(everyMs: number): number {
  const shown = useShown();
  const { store } = shown;
  const [now, setNow] = useState(() => store.serverNowMs());
  useEffect(
    () => asTimeGoes(shown, everyMs, () => startTransition(() => setNow(store.serverNowMs()))),
    [shown, store, everyMs],
  );
  return now;
}
