/**
 * What is looked at of a recording: the stretch in view, and the moment under the pointer. One for the timeline, all plots
 * and all lists of a page; neither moves the cursor. Times are in ns.
 */
import { useCallback, useSyncExternalStore } from "react";
import type { Channel } from "../live/channel";
import { useShown } from "../live/live";

export interface Stretch {
  fromNs: number;
  toNs: number;
}

type Topic = "window" | "hover" | "follow";

export class Looking {
  /** The stretch in view; null is the whole recording. */
  window: Stretch | null = null;
  /** The moment under the pointer. */
  hoverNs: number | null = null;
  /** The stretch in view goes along with a cursor that leaves it. */
  follow = true;
  private readonly listeners = new Map<Topic, Set<() => void>>();

  subscribe(topic: Topic, listener: () => void): () => void {
    const set = this.listeners.get(topic) ?? new Set();
    this.listeners.set(topic, set);
    set.add(listener);
    return () => void set.delete(listener);
  }

  setWindow(window: Stretch | null): void {
    if (window?.fromNs === this.window?.fromNs && window?.toNs === this.window?.toNs) return;
    this.window = window;
    this.tell("window");
  }

  setHover(tNs: number | null): void {
    if (tNs === this.hoverNs) return;
    this.hoverNs = tNs;
    this.tell("hover");
  }

  setFollow(follow: boolean): void {
    this.follow = follow;
    this.tell("follow");
  }

  private tell(topic: Topic): void {
    for (const listener of [...(this.listeners.get(topic) ?? [])]) listener();
  }
}

const looks = new WeakMap<Channel, Looking>();

/** What is looked at of the recording that is shown where this is called. */
export function useLooking(): Looking {
  const channel = useShown();
  const known = looks.get(channel) ?? new Looking();
  looks.set(channel, known);
  return known;
}

function useTopic<T>(topic: Topic, read: (looking: Looking) => T): T {
  const looking = useLooking();
  const subscribe = useCallback(
    (listener: () => void) => looking.subscribe(topic, listener),
    [looking, topic],
  );
  return useSyncExternalStore(subscribe, () => read(looking));
}

export const useWindow = () => useTopic("window", (looking) => looking.window);
export const useFollow = () => useTopic("follow", (looking) => looking.follow);
export const useHover = () => useTopic("hover", (looking) => looking.hoverNs);
