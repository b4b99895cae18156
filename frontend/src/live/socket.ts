/**
 * The socket to the bench: connects, hears, notices within a second that it is deaf, and connects again by itself.
 * The set of topics is sent anew after every connection, and whenever it changes.
 */
import { signedOut } from "../api/client";
import type { ServerMessage } from "../api/types";
import { Backoff } from "./backoff";
import { DeafnessTimer } from "./deafness";
import type { TraceFilter } from "../api/trace";
import type { FrameStore } from "./frames";
import type { LiveStore } from "./store";

const CHECK_MS = 100;
const GIVE_UP_MS = 3000;
/** Code with which the server closes the socket of a session that has ended. */
const SIGNED_OUT = 4401;
const BASE_TOPICS = ["link", "nodes", "axes", "rotor", "instructor", "events"];

export class LiveSocket {
  private readonly url: string;
  private readonly store: LiveStore;
  private readonly frames: FrameStore;
  private trace: (TraceFilter & { id: number }) | null = null;
  private readonly backoff = new Backoff();
  private readonly timer = new DeafnessTimer(performance.now());
  private readonly devices = new Map<string, number>();
  private socket: WebSocket | null = null;
  private openedMs = 0;
  private retry: ReturnType<typeof setTimeout> | null = null;
  private lastHeardWallMs: number | null = null;

  constructor(url: string, store: LiveStore, frames: FrameStore) {
    this.url = url;
    this.store = store;
    this.frames = frames;
    // The page cannot stop hearing while it exists: these two are never removed.
    setInterval(() => this.check(), CHECK_MS);
    // Timers of a hidden page are slowed down: look again at the moment it is shown.
    document.addEventListener("visibilitychange", () => this.check());
    this.connect();
  }

  /** Ask for the values of a device; the answer ends it. */
  watchDevice(slug: string): () => void {
    this.devices.set(slug, (this.devices.get(slug) ?? 0) + 1);
    this.sendTopics();
    return () => {
      const left = (this.devices.get(slug) ?? 1) - 1;
      if (left > 0) this.devices.set(slug, left);
      else this.devices.delete(slug);
      this.sendTopics();
    };
  }

  /** Ask for the running trace; the answer ends it. There is one at a time. */
  watchTrace(filter: TraceFilter & { id: number }): () => void {
    this.trace = filter;
    this.sendTopics();
    return () => {
      if (this.trace !== filter) return;
      this.trace = null;
      this.sendTopics();
    };
  }

  private connect(): void {
    this.retry = null;
    const socket = new WebSocket(this.url);
    this.socket = socket;
    this.openedMs = performance.now();
    socket.onopen = () => this.sendTopics();
    socket.onmessage = (message: MessageEvent<string>) => this.take(socket, message.data);
    socket.onclose = (event) => {
      if (event.code === SIGNED_OUT) signedOut();
      this.lost(socket);
    };
  }

  private take(socket: WebSocket, text: string): void {
    if (socket !== this.socket) return;
    this.backoff.reset();
    this.timer.heard(performance.now());
    this.lastHeardWallMs = Date.now();
    const message = JSON.parse(text) as ServerMessage;
    if (message.type === "trace") this.frames.take(message.data, performance.now());
    else this.store.apply(message);
    if (this.store.hearing.state !== "hearing") this.store.setHearing({ state: "hearing", sinceMs: null });
  }

  private lost(socket: WebSocket): void {
    if (socket !== this.socket) return;
    this.socket = null;
    this.retry ??= setTimeout(() => this.connect(), this.backoff.next());
  }

  private check(): void {
    const nowMs = performance.now();
    const { deaf, lastHeardMs } = this.timer.check(nowMs);
    if (!deaf) return;
    this.store.setHearing({ state: "deaf", sinceMs: this.lastHeardWallMs });
    // An open socket that says nothing is no connection: drop it, so that a new one is made.
    const silentMs = nowMs - Math.max(lastHeardMs ?? 0, this.openedMs);
    if (this.socket && silentMs > GIVE_UP_MS) {
      const socket = this.socket;
      this.lost(socket);
      socket.close();
    }
  }

  private sendTopics(): void {
    if (this.socket?.readyState !== WebSocket.OPEN) return;
    const slugs = [...this.devices.keys()];
    const topics = [...BASE_TOPICS, ...slugs.map((slug) => `values:${slug}`)];
    const { trace } = this;
    if (trace !== null) topics.push("trace");
    this.socket.send(JSON.stringify({ type: "subscribe", topics, ...(trace === null ? {} : { trace }) }));
  }
}
