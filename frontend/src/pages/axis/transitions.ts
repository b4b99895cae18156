/** The transitions of an axis (CiA 402; OAT manual tables 50 and 52): which command leads from where to where. */

export enum Command {
  Shutdown = "shutdown",
  SwitchOn = "switch_on",
  EnableOperation = "enable_operation",
  DisableOperation = "disable_operation",
  DisableVoltage = "disable_voltage",
  QuickStop = "quick_stop",
  FaultReset = "fault_reset",
  Feather = "feather",
}

/** Controlwords by which each is commanded. */
export const WORDS: Record<Command, string> = {
  [Command.Shutdown]: "0106h",
  [Command.SwitchOn]: "0107h",
  [Command.EnableOperation]: "010Fh",
  [Command.DisableOperation]: "0107h",
  [Command.DisableVoltage]: "010Ch",
  [Command.QuickStop]: "010Bh",
  [Command.FaultReset]: "0186h",
  [Command.Feather]: "080Fh",
};

export interface Transition {
  number: number;
  /** Null: from every state. */
  from: string | null;
  to: string;
  /** Null: the drive goes by itself. */
  command: Command | null;
  /** How it is drawn, and where its number stands. */
  path: string;
  at: readonly [number, number];
}

const OFF = "switch_on_disabled";
const READY = "ready_to_switch_on";
const ON = "switched_on";
const ENABLED = "operation_enabled";
const QUICK = "quick_stop_active";
const FAULT = "fault";
const REACTION = "fault_reaction_active";

export const TRANSITIONS: readonly Transition[] = [
  { number: 1, from: "not_ready_to_switch_on", to: OFF, command: null, path: "M80 40 V73", at: [86, 62] },
  { number: 2, from: OFF, to: READY, command: Command.Shutdown, path: "M44 112 V145", at: [24, 134] },
  { number: 7, from: READY, to: OFF, command: Command.DisableVoltage, path: "M112 148 V115", at: [118, 134] },
  { number: 3, from: READY, to: ON, command: Command.SwitchOn, path: "M44 184 V217", at: [24, 206] },
  { number: 6, from: ON, to: READY, command: Command.Shutdown, path: "M112 220 V187", at: [118, 206] },
  { number: 4, from: ON, to: ENABLED, command: Command.EnableOperation, path: "M44 256 V289", at: [24, 278] },
  {
    number: 5,
    from: ENABLED,
    to: ON,
    command: Command.DisableOperation,
    path: "M112 292 V259",
    at: [118, 278],
  },
  {
    number: 8,
    from: ENABLED,
    to: READY,
    command: Command.Shutdown,
    path: "M158 304 H174 V166 H161",
    at: [162, 180],
  },
  {
    number: 10,
    from: ON,
    to: OFF,
    command: Command.DisableVoltage,
    path: "M158 232 H190 V102 H161",
    at: [176, 118],
  },
  {
    number: 9,
    from: ENABLED,
    to: OFF,
    command: Command.DisableVoltage,
    path: "M158 312 H206 V93 H161",
    at: [209, 290],
  },
  {
    number: 12,
    from: QUICK,
    to: OFF,
    command: Command.DisableVoltage,
    path: "M250 238 H222 V84 H161",
    at: [225, 180],
  },
  { number: 15, from: FAULT, to: OFF, command: Command.FaultReset, path: "M250 78 H161", at: [226, 72] },
  {
    number: 11,
    from: ENABLED,
    to: QUICK,
    command: Command.QuickStop,
    path: "M158 320 H346 V259",
    at: [352, 292],
  },
  {
    number: 16,
    from: QUICK,
    to: ENABLED,
    command: Command.Feather,
    path: "M290 256 V344 H80 V331",
    at: [296, 341],
  },
  { number: 13, from: null, to: REACTION, command: null, path: "M206 22 H247", at: [208, 15] },
  { number: 14, from: REACTION, to: FAULT, command: null, path: "M328 40 V73", at: [334, 62] },
];
