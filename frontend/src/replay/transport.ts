/** The cursor as people move it. What is dragged is sent as fast as the server answers, and only the latest of it. */
import { type CursorOrder, type Loop, orderCursor } from "../api/replay";
import type { CursorData } from "../api/types";

export const SPEEDS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50] as const;

export class Transport {
  private readonly replay: string;
  private failed: (error: unknown) => void = () => undefined;
  private dragged: number | null = null;
  private dragging = false;

  constructor(replay: string) {
    this.replay = replay;
  }

  /** Calls `failed` with what goes wrong from now on. */
  tell(failed: (error: unknown) => void): void {
    this.failed = failed;
  }

  readonly play = (): void => this.order({ action: "play" });
  readonly pause = (): void => this.order({ action: "pause" });
  readonly setSpeed = (speed: number): void => this.order({ action: "speed", speed });
  readonly setLoop = (loop: Loop | null): void => this.order({ action: "loop", loop: loop && exact(loop) });
  readonly stepTime = (seconds: number): void =>
    this.order({ action: "step", by: "time", dt_ms: seconds * 1000 });
  readonly step = (by: "frame" | "event", forward: boolean): void =>
    this.order({ action: "step", by, forward });

  readonly toggle = (cursor: CursorData | null): void => (cursor?.playing ? this.pause() : this.play());

  /** Set the cursor. While an earlier place is on its way only the latest one waits. */
  readonly seek = (tNs: number): void => {
    this.dragged = Math.round(tNs);
    if (!this.dragging) void this.drag();
  };

  private async drag(): Promise<void> {
    this.dragging = true;
    try {
      while (this.dragged !== null) {
        const tNs = this.dragged;
        this.dragged = null;
        await orderCursor(this.replay, { action: "seek", t_ns: tNs });
      }
    } catch (error) {
      this.dragged = null;
      this.failed(error);
    } finally {
      this.dragging = false;
    }
  }

  private order(order: CursorOrder): void {
    orderCursor(this.replay, order).catch((error: unknown) => this.failed(error));
  }
}

const exact = ({ from_ns, to_ns }: Loop): Loop => ({
  from_ns: Math.round(from_ns),
  to_ns: Math.round(to_ns),
});

/** The next speed of the list, faster or slower. */
export function speedBeside(speed: number, faster: boolean): number {
  const beside = faster
    ? SPEEDS.find((one) => one > speed * 1.001)
    : SPEEDS.findLast((one) => one < speed * 0.999);
  return beside ?? speed;
}
