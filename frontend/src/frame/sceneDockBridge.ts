/**
 * What the 3D frame and the page tell each other; the other end is app/scene/bridge.js. The frame is of our own origin,
 * and nothing else is listened to.
 */
import { type RefObject, useEffect, useEffectEvent } from "react";
import type { Theme } from "./search";

export const CAMERAS = [
  "front",
  "hub",
  "blade-1",
  "blade-2",
  "blade-3",
  "shaft",
  "cylinders-1",
  "cylinders-2",
  "cylinders-3",
] as const;
/** Looks at what stands on a bench. */
export const BENCH_CAMERA = "shaft";
export type CameraName = (typeof CAMERAS)[number];

/** Which cylinders a camera looks at, from 1 in the order of the stations that have some; null for another camera. */
export const cylindersOf = (camera: CameraName): number | null =>
  Number(/^cylinders-(\d)$/.exec(camera)?.[1] ?? 0) || null;

/** What one view shows; others have their own. */
export interface View {
  theme: Theme;
  camera: CameraName;
  selected: number | null;
  ghosts: boolean;
}

/** Where a label belongs in the frame, px. `faces`: it is on the side that is seen. */
export interface Place {
  id: string;
  x: number;
  y: number;
  faces: boolean;
}

export interface Places {
  places: Place[];
  width: number;
  height: number;
}

export type FromScene =
  | { hubside: "ready" }
  | { hubside: "link"; up: boolean }
  | { hubside: "select"; blade: number }
  | { hubside: "freed" }
  | ({ hubside: "places" } & Places);

/** Hear what the frame tells while the component is there. */
export function useSceneMessages(
  frame: RefObject<HTMLIFrameElement | null>,
  hear: (message: FromScene) => void,
): void {
  const take = useEffectEvent((event: MessageEvent) => {
    if (event.origin !== location.origin || event.source !== frame.current?.contentWindow) return;
    const data = event.data as FromScene | null;
    if (typeof data?.hubside === "string") hear(data);
  });
  useEffect(() => {
    const listener = (event: MessageEvent) => take(event);
    addEventListener("message", listener);
    return () => removeEventListener("message", listener);
  }, []);
}

/** `again`: the camera's button was pressed, so it flies there even if it was chosen before. */
export function tellScene(frame: HTMLIFrameElement | null, view: View, again = false): void {
  frame?.contentWindow?.postMessage({ hubside: "view", ...view, again }, location.origin);
}

interface Box {
  width: number;
  height: number;
}

const EDGE_PX = 6;

/** Centres of labels, moved into the frame and apart from each other, in the order given. */
export function arranged(
  wanted: { x: number; y: number; box: Box }[],
  frame: Box,
): { x: number; y: number }[] {
  const placed: { x: number; y: number; box: Box }[] = [];
  for (const { x, y, box } of wanted) {
    const left = box.width / 2 + EDGE_PX;
    const top = box.height / 2 + EDGE_PX;
    const at = {
      x: within(x, left, frame.width - left),
      y: within(y, top, frame.height - top),
      box,
    };
    for (const other of placed) {
      const reachX = (box.width + other.box.width) / 2 + EDGE_PX;
      const reachY = (box.height + other.box.height) / 2 + EDGE_PX;
      if (Math.abs(at.x - other.x) >= reachX || Math.abs(at.y - other.y) >= reachY) continue;
      const down = at.y >= other.y;
      const moved = other.y + (down ? reachY : -reachY);
      const fits = moved >= top && moved <= frame.height - top;
      at.y = fits ? moved : other.y + (down ? -reachY : reachY);
    }
    placed.push(at);
  }
  return placed.map(({ x, y }) => ({ x: Math.round(x), y: Math.round(y) }));
}

const within = (value: number, low: number, high: number) => Math.max(low, Math.min(high, value));
