/** One timer for all that look at the time equally often: sixty readings of a page are looked at in one go. */

type Listener = () => void;

interface Ring {
  readonly listeners: Set<Listener>;
  readonly timer: ReturnType<typeof setInterval>;
}

const rings = new Map<number, Ring>();

function begin(ms: number): Ring {
  const listeners = new Set<Listener>();
  const ring = () => {
    for (const listener of [...listeners]) listener();
  };
  return { listeners, timer: setInterval(ring, ms) };
}

/** Calls `listener` every `ms`; the answer ends it. */
export function every(ms: number, listener: Listener): () => void {
  const ring = rings.get(ms) ?? begin(ms);
  rings.set(ms, ring);
  ring.listeners.add(listener);
  return () => {
    ring.listeners.delete(listener);
    if (ring.listeners.size > 0 || rings.get(ms) !== ring) return;
    clearInterval(ring.timer);
    rings.delete(ms);
  };
}
