/**
 * The types of the HTTP API and of the socket, under the names that the page uses. All but the description, which the
 * server sends as one document, are generated from the Python models. Times are Unix nanoseconds.
 */
import type { StateMachine } from "../model/stateMachine";
import type { components } from "./generated";

type Schemas = components["schemas"];

export type Session = Schemas["Session"];
export type Language = Session["locale"];
export type Turbine = Schemas["Turbine"];
export type Mode = Turbine["mode"];
export type StationRef = Schemas["StationRef"];
export type DeviceRef = Schemas["DeviceRef"];

/** Its own text is left aside: the page makes it of key and details, in the language in which it is shown. */
export type ProblemDoc = Omit<Schemas["Problem"], "text">;
export type Job = Schemas["JobDoc"];
export type JobRow = Schemas["JobRowDoc"];
export type Failure = Schemas["Failure"];
export type Favourites = Schemas["Favourites"];
export type ParameterChange = Schemas["ParameterChange"];
export type ParameterChanges = Schemas["ParameterChanges"];
export type WritesRequest = Schemas["WritesRequest"];
export type WriteResult = Schemas["WriteDone"];
export type SaveResult = Schemas["SaveDone"];
export type RestartResult = Schemas["RestartDone"];
export type VerifyResult = Schemas["VerifyDone"];
export type StopResult = Schemas["StopDone"];

export type ServerMessage = Schemas["ServerMessage"];
export type BenchData = Schemas["BenchData"];
export type LinkData = Schemas["LinkLine"];
export type RecordingStatus = Schemas["RecordingLine"];
export type NodeData = Schemas["NodeLine"];
export type AxisData = Schemas["AxisLine"];
export type RotorData = Schemas["RotorLine"];
export type CylindersData = Schemas["CylindersLine"];
export type CylinderData = Schemas["CylinderLine"];
export type InstructorData = Schemas["InstructorLine"];
export type MotionData = Schemas["MotionLine"];
export type ValuesData = Schemas["ValuesData"];
export type ValueData = Schemas["ValueCell"];
export type EventData = Schemas["EventLine"];
export type CursorData = Schemas["CursorLine"];

export type RecordingList = Schemas["RecordingList"];
export type RecordingRef = Schemas["RecordingRef"];
export type RecordingDoc = Schemas["RecordingDoc"];
export type SetList = Schemas["SetList"];
export type SetRecord = Schemas["SetRecordDoc"];
export type SetTag = Schemas["SetTag"];
export type SetDoc = Schemas["SetDoc"];

/** What fills the placeholders of a text. */
export type Details = Record<string, unknown>;

/** A raw value as JSON carries it: octets as hexadecimal digits, integers beyond 2^53 as decimal digits. */
export type Raw = number | string;

/* The description of a device, as app/model/od_export.py writes it; only what the page reads. */

export type Access = "ro" | "wo" | "rw" | "r(w)" | "const";

/** A limit is a raw number, or the raw value of another object times a factor. */
export type LimitDoc = number | { address: string; factor: number };

export type RawDoc = number | string | { hex: string };

export interface QuantityDoc {
  unit: string;
  scale: number;
  decimals: number;
}

/** What is in force by the raw value of another object. */
export interface RuleDoc<T> {
  address: string;
  choices: Record<string, T>;
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
  /** Values allowed beyond the limits. */
  also: number[];
  /** Replace names, bits and limits while the object that they name holds one of these raw values. */
  enumeration_from: RuleDoc<string> | null;
  bits_from: RuleDoc<string> | null;
  limits_from: RuleDoc<{ minimum: LimitDoc | null; maximum: LimitDoc | null }> | null;
  /** A raw value is a multiple of it. */
  step: number;
  /** The only raw values; empty: any within the limits. */
  only: number[];
  enumeration: string | null;
  bits: string | null;
  restore: "copy" | "unit" | "factory" | "network" | "never";
  verify: "equal" | "ack" | "effect";
  /** `writing`: asked of writes of these raw values only; empty or missing for all. */
  requires: { address: string; values: number[]; writing?: number[] }[];
  note: string | null;
  /** The save category that keeps it, where a device saves by categories. */
  save_category: string | null;
  by_variant: Record<string, { default: RawDoc | null; minimum: LimitDoc | null; maximum: LimitDoc | null }>;
  /** Its manual does not print all of it: what not is in `unproven` (nothing named: all), `origin` tells it instead. */
  inferred: boolean;
  unproven: string[];
  origin: string | null;
  /** A write can set an axis in motion. */
  motion: boolean;
  hexadecimal: boolean;
  /** An address of the internet, its first number in the highest byte. */
  ipv4: boolean;
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

export interface ErrorDoc {
  code: number;
  name: string;
  text_key: string;
  reaction: string | null;
  /** What the device has seen; null where nothing is known. */
  cause_key: string | null;
  /** What to do, one step a line; null where nothing is known. */
  first_aid_key: string | null;
  /** Its number in a family that shares these texts: fills their placeholder `number`. */
  number: number | null;
}

export interface DescriptionDoc {
  id: string;
  version: string;
  name: string;
  vendor: string;
  bus: "canopen" | "modbus-tcp" | "profibus-dp";
  manual: string;
  groups: { id: string; text_key: string }[];
  bit_tables: Record<string, BitDoc[]>;
  enumerations: Record<string, EnumerationDoc>;
  errors: ErrorDoc[];
  /** Null for the states of CiA 402, and for what is no axis. */
  state_machine: StateMachine | null;
  entries: EntryDoc[];
  /** What makes RAM permanent; `category` null: all of it. */
  save: { address: string; category: string | null }[];
  /** Devices that share this description, and how each is known. */
  variant_matches: { id: string; name: string; device_name: string | null; product_code: number | null }[];
  /** Titles of what tells facts that the device's own manual does not print, by id. */
  sources: Record<string, string>;
}
