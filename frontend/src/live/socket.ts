/**
 * The socket to the bench: connects, hears, notices within a second that it is deaf, and connects again by itself.
 * The topics of every channel are sent anew after every connection, and whenever they change. One socket serves all.
 */
import { signedOut } from "../api/client";
import type { components } from "../api/generated";
import type { ServerMessage } from "../api/types";
import { Asked, type Command } from "./asked";
import { Backoff } from "./backoff";
import { DeafnessTimer } from "./deafness";
import type { Channel } from "./channel";
import { PAGE } from "./page";

/** What a page with the lease says: that it is there, and whether its person holds what moves an axis. */
export type Beat = Omit<Schemas["Beat"], "type">;
/** Which of this page: sent both ways, it is done once. */
export interface Press {
  readonly page: string;
  readonly number: number;
}
type Schemas = components["schemas"];

/** STOP or FEATHER, to every axis or that of one device. */
export type Urgent = Pick<Schemas["Urgent"], "command"> & { device?: string };

const CHECK_MS = 100;
const GIVE_UP_MS = 3000;
/** Code with which the server closes the socket of a session that has ended. */
const SIGNED_OUT = 4401;

export class LiveSocket {
  private readonly url: string;
  private readonly live: Channel;
  private readonly channels = new Map<string, Channel>();
  private readonly backoff = new Backoff();
  private readonly timer = new DeafnessTimer(performance.now());
  private socket: WebSocket | null = null;
  private openedMs = 0;
  private retry: ReturnType<typeof setTimeout> | null = null;
  private lastHeardWallMs: number | null = null;
  private readonly urgent = new Asked();

  constructor(url: string, live: Channel) {
    this.url = url;
    this.live = live;
    this.open(live, () => undefined);
    // The page cannot stop hearing while it exists: these two are never removed.
    setInterval(() => this.check(), CHECK_MS);
    // Timers of a hidden page are slowed down: look again at the moment it is shown.
    document.addEventListener("visibilitychange", () => this.check());
    this.connect();
  }

  /** Hear of a channel; `gone` is called where the server does not know it. The answer ends it. */
  open(channel: Channel, gone: () => void): () => void {
    this.channels.set(channel.ctx, channel);
    channel.attach(() => this.subscribe(channel), gone);
    this.subscribe(channel);
    return () => {
      if (this.channels.get(channel.ctx) !== channel) return;
      this.channels.delete(channel.ctx);
      channel.attach(
        () => undefined,
        () => undefined,
      );
      this.say({ type: "subscribe", ctx: channel.ctx, topics: [] });
    };
  }

  private connect(): void {
    this.retry = null;
    const socket = new WebSocket(this.url);
    this.socket = socket;
    this.openedMs = performance.now();
    socket.onopen = () => {
      for (const channel of this.channels.values()) this.subscribe(channel);
    };
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
    const channel = this.channels.get(message.ctx);
    if (message.type === "gone") channel?.tellGone();
    else if (message.type === "urgent") this.urgent.told(message.data);
    else if (message.type === "trace") channel?.frames.take(message.data, performance.now());
    else channel?.store.apply(message);
    const { store } = this.live;
    if (store.hearing.state !== "hearing") store.setHearing({ state: "hearing", sinceMs: null });
  }

  private lost(socket: WebSocket): void {
    if (socket !== this.socket) return;
    this.socket = null;
    this.urgent.lost();
    this.retry ??= setTimeout(() => this.connect(), this.backoff.next());
  }

  private check(): void {
    const nowMs = performance.now();
    const { deaf, lastHeardMs } = this.timer.check(nowMs);
    if (!deaf) return;
    this.live.store.setHearing({ state: "deaf", sinceMs: this.lastHeardWallMs });
    // An open socket that says nothing is no connection: drop it, so that a new one is made.
    const silentMs = nowMs - Math.max(lastHeardMs ?? 0, this.openedMs);
    if (this.socket && silentMs > GIVE_UP_MS) {
      const socket = this.socket;
      this.lost(socket);
      socket.close();
    }
  }

  private subscribe(channel: Channel): void {
    if (this.channels.get(channel.ctx) === channel) this.say(channel.request());
  }

  /** The dead man; false where the socket is not open. */
  beat(beat: Beat): boolean {
    return this.say({ type: "beat", ...beat });
  }

  /** STOP or FEATHER ahead of all requests; `command` null where the socket is not open. */
  command(urgent: Urgent): { press: Press; command: Command | null } {
    const [number, command] = this.urgent.ask();
    const press = { page: PAGE, number };
    return { press, command: this.say({ type: "urgent", ...press, ...urgent }) ? command : null };
  }

  private say(request: object): boolean {
    if (this.socket?.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(request));
    return true;
  }
}
