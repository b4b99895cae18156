/** The types of the HTTP API and of the socket, as the rest of the page uses them. Times are Unix nanoseconds. */

export type Language = "en" | "de";
export type Mode = "live" | "twin" | "none";

/** A raw value as JSON carries it. Octet strings are given as hexadecimal digits. */
export type Raw = number | string;

export interface Session {
  version: string;
  role: string;
  languages: Language[];
  locale: Language;
}

export interface DeviceRef {
  slug: string;
  node: number;
  description_id: string;
  name: string;
}

export interface StationRef {
  slug: string;
  name: string;
  blade: number | null;
  devices: DeviceRef[];
}

export interface Turbine {
  slug: string;
  name: string;
  mode: Mode;
  bus: { name: string; bitrate: number; interface: string };
  stations: StationRef[];
}

export type Access = "ro" | "wo" | "rw" | "r(w)" | "const";

/** A limit is a raw number, or the raw value of another object times a factor. */
export type LimitDoc = number | { address: string; factor: number };

export type RawDoc = number | string | { hex: string };

export interface QuantityDoc {
  unit: string;
  scale: number;
  decimals: number;
}

export interface EntryDoc extends QuantityDoc {
  address: string;
  name: string;
  object_name: string;
  title: string;
  kind: "var" | "array" | "record";
  type: string;
  bit_count: number | null;
  range: [number, number] | null;
  access: Access;
  readable: boolean;
  writable: boolean;
  pdo: boolean;
  default: RawDoc | null;
  node_id: boolean;
  saved: boolean;
  group: string;
  section: string;
  unit_from: { address: string; shaft: string | null; choices: Record<string, QuantityDoc> } | null;
  minimum: LimitDoc | null;
  maximum: LimitDoc | null;
  enumeration: string | null;
  bits: string | null;
  restore: "copy" | "unit" | "factory" | "never";
  verify: "equal" | "ack" | "effect";
  requires: { address: string; values: number[] }[];
  note: string | null;
  inferred: boolean;
  hexadecimal: boolean;
}

export interface BitDoc {
  bit: number;
  last: number;
  name: string;
  text_key: string;
  clamp: string | null;
  error_code: number | null;
}

export interface EnumerationDoc {
  exclusive: boolean;
  values: { value: number; name: string; text_key: string }[];
}

export interface DescriptionDoc {
  id: string;
  version: string;
  name: string;
  vendor: string;
  manual: string;
  groups: { id: string; text_key: string }[];
  bit_tables: Record<string, BitDoc[]>;
  enumerations: Record<string, EnumerationDoc>;
  errors: { code: number; name: string; text_key: string; reaction: string | null }[];
  entries: EntryDoc[];
}

export type Details = Record<string, unknown>;

export interface ProblemDoc {
  type: string;
  title: string;
  status: number;
  code: string;
  text_key: string;
  details: Details;
  device_state: string | null;
}

export interface JobFailure {
  address: string;
  code: string;
  text_key: string;
  details: Details;
}

export interface Job {
  id: string;
  kind: string;
  device: string;
  state: "running" | "done" | "failed" | "cancelled";
  done: number;
  total: number;
  failed: JobFailure[];
  /** Why it failed as a whole. */
  error: JobFailure | null;
}

export interface WriteResult {
  address: string;
  sent_raw: Raw;
  read_raw: Raw | null;
  verified: boolean;
  was_raw: Raw | null;
  t_ns: number;
}

export interface SaveResult {
  t_ns: number;
  took_s: number;
}

export interface RestartResult {
  boot_up_t_ns: number;
  took_s: number;
}

export interface StopResult {
  axes: {
    device: string;
    sent_t_ns: number;
    confirmed_t_ns: number | null;
    how: "rpdo" | "sdo" | "failed";
  }[];
}

/* The socket */

export interface RecordingStatus {
  state: "on" | "off" | "stopped";
  file: string | null;
  since_ns: number | null;
  size_bytes: number;
  frames: number;
  lost: number;
  reason: string | null;
}

export interface LinkData {
  state: "connected" | "lost" | "disconnected";
  reason: string | null;
  mode: Mode;
  bus: string;
  bitrate: number;
  load: number;
  frames: number;
  recording: RecordingStatus;
  dropped: number;
  other_masters: { bus: string; sign: string; can_id: number; t_ns: number; count: number }[];
}

export type NmtName = "operational" | "pre-operational" | "stopped" | "booting" | "unknown";

export interface NodeData {
  device: string;
  node: number;
  nmt: NmtName;
  /** Its heartbeat is overdue. */
  silent: boolean;
  heartbeat_t_ns: number | null;
  heartbeat_period_ms: number | null;
  boots: number;
}

export interface AxisData {
  station: string;
  blade: number;
  position_deg: number | null;
  position_t_ns: number | null;
  demand_deg: number | null;
  velocity_dps: number | null;
  state: string | null;
  fault_code: number | null;
  fault_text_key: string | null;
  battery_soc_pct: number | null;
  battery_v: number | null;
  dc_link_v: number | null;
  stale: boolean;
}

export interface ValueData {
  raw: Raw | null;
  hex: string | null;
  t_ns: number | null;
  source: "sdo-read" | "sdo-write" | "pdo" | "emcy" | null;
  stored: { raw: Raw; state: "proven" | "saved" } | null;
  known: boolean;
  /** Frames were lost since it was seen, or its mirror was written. */
  stale: boolean;
}

export interface ValuesData {
  device: string;
  /** These are all that is known: drop what was known before. */
  full: boolean;
  values: Record<string, ValueData>;
}

export interface EventData {
  t_ns: number;
  severity: "info" | "warning" | "error";
  device: string | null;
  text_key: string;
  details: Details;
}

interface Envelope<T extends string, D> {
  v: 1;
  ctx: "live";
  type: T;
  seq: number;
  t_ns: number;
  data: D;
}

export type ServerMessage =
  | Envelope<"hello", { version: string; server_t_ns: number }>
  | Envelope<"heartbeat", unknown>
  | Envelope<"link", LinkData>
  | Envelope<"nodes", NodeData[]>
  | Envelope<"axes", AxisData[]>
  | Envelope<"values", ValuesData>
  | Envelope<"event", EventData>;
