/**
 * What the page knows of the bench, fed by the socket alone.
 *
 * Messages are taken in at once but shown coalesced: listeners of a topic are told at most once a tick of `schedule`
 * (an animation frame in the browser), however many messages came. Topics: "hearing", "bench", "link", "nodes", "axes",
 * "rotor", "cylinders", "instructor", "motion", "events", "cursor", "device:<slug>" and "value:<slug>/<address>".
 *
 * The store of a recording goes by the time of its cursor, and forgets whatever it knew as soon as that is set elsewhere.
 */
import type {
  AxisData,
  BenchData,
  CursorData,
  CylindersData,
  EventData,
  InstructorData,
  LinkData,
  MotionData,
  NodeData,
  RotorData,
  ServerMessage,
  ValueData,
  ValuesData,
} from "../api/types";
import { followsDemand } from "./axis";
import { type Columns, GAP_S, Trace } from "./trace";

export const MAX_EVENTS = 500;
const LOAD_HISTORY = 60;

/** A value as shown: what the socket said, and when (server clock) it last became another one. */
export interface Cell extends ValueData {
  changedAtMs: number | null;
}

export interface HearingState {
  state: "connecting" | "hearing" | "deaf";
  /** Wall clock of the page, ms, when the last message came. */
  sinceMs: number | null;
}

export interface NumberedEvent extends EventData {
  id: number;
}

type Listener = () => void;

export class LiveStore {
  hearing: HearingState = { state: "connecting", sinceMs: null };
  bench: BenchData | null = null;
  link: LinkData | null = null;
  nodes: ReadonlyMap<string, NodeData> = new Map();
  axes: ReadonlyMap<number, AxisData> = new Map();
  rotor: RotorData | null = null;
  cylinders: readonly CylindersData[] = [];
  instructor: InstructorData | null = null;
  motion: MotionData | null = null;
  events: readonly NumberedEvent[] = [];
  loadHistory: readonly number[] = [];
  /** Where a recording stands; null for the bench. */
  cursor: CursorData | null = null;
  readonly traces = new Map<number, Trace>();
  /** Of axes that turn no blade, by their device. */
  readonly deviceTraces = new Map<string, Trace>();

  private readonly devices = new Map<string, Map<string, Cell>>();
  private readonly snapshots = new Map<string, number>();
  private readonly listeners = new Map<string, Set<Listener>>();
  private readonly dirty = new Set<string>();
  private readonly schedule: (flush: () => void) => void;
  private readonly nowMs: () => number;
  private scheduled = false;
  private nextEventId = 1;
  private serverOffsetMs: number | null = null;
  private readonly recorded: boolean;
  private shownMs = 0;

  constructor(schedule: (flush: () => void) => void, nowMs: () => number, recorded = false) {
    this.schedule = schedule;
    this.nowMs = nowMs;
    this.recorded = recorded;
  }

  subscribe(topic: string, listener: Listener): () => void {
    const set = this.listeners.get(topic) ?? new Set();
    this.listeners.set(topic, set);
    set.add(listener);
    return () => {
      set.delete(listener);
      if (set.size === 0) this.listeners.delete(topic);
    };
  }

  /** What is now, in ms since 1970: by the server's clock, as far as it is known; of a recording the time of its cursor. */
  serverNowMs(): number {
    if (this.recorded) return this.shownMs;
    return this.nowMs() + (this.serverOffsetMs ?? 0);
  }

  cell(device: string, address: string): Cell | undefined {
    return this.devices.get(device)?.get(address);
  }

  cells(device: string): ReadonlyMap<string, Cell> | undefined {
    return this.devices.get(device);
  }

  /** Number of value messages seen for the device; 0 before its first snapshot. */
  version(device: string): number {
    return this.snapshots.get(device) ?? 0;
  }

  setHearing(state: HearingState): void {
    if (state.state === this.hearing.state && state.sinceMs === this.hearing.sinceMs) return;
    this.hearing = state;
    this.mark("hearing");
  }

  apply(message: ServerMessage): void {
    this.serverOffsetMs = message.t_ns / 1e6 - this.nowMs();
    this.shownMs = message.t_ns / 1e6;
    switch (message.type) {
      case "hello":
      case "heartbeat":
        return;
      case "bench":
        return this.applyBench(message.data);
      case "link":
        this.link = message.data;
        this.loadHistory = [...this.loadHistory, message.data.load].slice(-LOAD_HISTORY);
        return this.mark("link");
      case "nodes":
        this.nodes = new Map([...this.nodes, ...message.data.map((node) => [node.device, node] as const)]);
        return this.mark("nodes");
      case "axes":
        return this.applyAxes(message.data, message.t_ns);
      case "rotor":
        this.rotor = message.data;
        return this.mark("rotor");
      case "cylinders":
        this.cylinders = message.data;
        return this.mark("cylinders");
      case "instructor":
        this.instructor = message.data;
        return this.mark("instructor");
      case "motion":
        return this.takeMotion(message.data);
      case "values":
        return this.applyValues(message.data);
      case "event":
        return this.applyEvent(message.data);
      case "cursor":
        this.cursor = message.data;
        return this.mark("cursor");
    }
  }

  /** Who may move the axes, as the socket or the answer to our own request says. */
  takeMotion(motion: MotionData): void {
    this.motion = motion;
    this.mark("motion");
  }

  /** Another connection: whatever was known of the one before is void. */
  private applyBench(bench: BenchData): void {
    // A server that was started anew counts its connections anew: the turbine may be another one all the same.
    const before = this.bench;
    const another = before !== null && (before.epoch !== bench.epoch || before.turbine !== bench.turbine);
    this.bench = bench;
    this.mark("bench");
    if (!another) return;
    this.nodes = new Map();
    this.axes = new Map();
    this.rotor = null;
    this.cylinders = [];
    this.traces.clear();
    this.deviceTraces.clear();
    // The bench goes on after another connection; what a recording tells is told anew from where its cursor stands.
    if (this.recorded) this.events = [];
    for (const topic of ["nodes", "axes", "rotor", "cylinders", "events"]) this.mark(topic);
    for (const device of [...this.devices.keys()]) this.applyValues({ device, full: true, values: {} });
  }

  private applyAxes(axes: AxisData[], tNs: number): void {
    this.axes = new Map([...this.axes, ...axes.map((axis) => [axis.blade, axis] as const)]);
    // Played so many times as fast, what is told in a second lies so much farther apart.
    const stretch = Math.max(1, this.cursor?.speed ?? 1);
    for (const axis of axes) {
      const trace = this.traces.get(axis.blade) ?? new Trace();
      this.traces.set(axis.blade, trace);
      // A stale position is a gap in the trace, never the last value drawn on.
      const demand = axis.stale || !followsDemand(axis) ? null : axis.demand_deg;
      const known = <T>(number: T | null) => (axis.stale ? null : number);
      trace.push(
        tNs / 1e9,
        {
          positionDeg: known(axis.position_deg),
          demandDeg: demand,
          velocityDps: known(axis.velocity_dps),
          currentPct: known(axis.current_pct),
        },
        GAP_S * stretch,
      );
    }
    this.mark("axes");
  }

  /** What an axis did before the cursor was set where it stands, as the index of the recording has it. */
  fillTrace(blade: number, earlier: Columns): void {
    const trace = this.traces.get(blade) ?? new Trace();
    this.traces.set(blade, trace);
    trace.prepend(earlier);
  }

  private applyValues({ device, full, values }: ValuesData): void {
    const known = this.devices.get(device) ?? new Map<string, Cell>();
    this.devices.set(device, known);
    if (full) this.dropMissing(device, known, values);
    for (const [address, value] of Object.entries(values)) {
      const before = known.get(address);
      const changed = before?.known === true && value.known && before.hex !== value.hex;
      known.set(address, {
        ...value,
        changedAtMs: changed ? this.serverNowMs() : (before?.changedAtMs ?? null),
      });
      this.mark(`value:${device}/${address}`);
    }
    this.snapshots.set(device, this.version(device) + 1);
    this.mark(`device:${device}`);
  }

  private dropMissing(device: string, known: Map<string, Cell>, values: Record<string, ValueData>): void {
    for (const address of known.keys()) {
      if (address in values) continue;
      known.delete(address);
      this.mark(`value:${device}/${address}`);
    }
  }

  private applyEvent(event: EventData): void {
    // After a new connection the server tells the recent events again: each is shown once, in order of time.
    const same = (one: EventData) =>
      one.t_ns === event.t_ns && one.text_key === event.text_key && one.device === event.device;
    if (this.events.some(same)) return;
    const at = this.events.findIndex((one) => one.t_ns <= event.t_ns);
    const place = at < 0 ? this.events.length : at;
    this.events = this.events.toSpliced(place, 0, { ...event, id: this.nextEventId }).slice(0, MAX_EVENTS);
    this.nextEventId += 1;
    this.mark("events");
  }

  private mark(topic: string): void {
    this.dirty.add(topic);
    if (this.scheduled) return;
    this.scheduled = true;
    this.schedule(() => this.flush());
  }

  private flush(): void {
    this.scheduled = false;
    const topics = [...this.dirty];
    this.dirty.clear();
    for (const topic of topics) for (const listener of [...(this.listeners.get(topic) ?? [])]) listener();
  }
}
