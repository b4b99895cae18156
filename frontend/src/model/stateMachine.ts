/** The state machine of an axis as its description tells it; one that tells none has that of CiA 402. */
import type { DescriptionDoc } from "../api/types";
import { axisStateKey } from "./axisState";

export interface MachineState {
  name: string;
  text_key: string;
  bits: number;
  mask: number;
  powered: boolean;
  runs: boolean;
  fault: boolean;
  /** Column and row in a drawing. */
  place: readonly [number, number];
}

export interface MachineTransition {
  name: string;
  /** `*`: from every state. */
  source: string;
  target: string;
  /** The controlword that leads there; null: the device goes by itself. */
  word: number | null;
  command_key: string | null;
}

export interface StateMachine {
  profile: string;
  controlword: string;
  statusword: string;
  stop_word: number;
  states: readonly MachineState[];
  transitions: readonly MachineTransition[];
}

/** Text key of the state that a statusword tells; null for bits that no state has. */
export function stateKeyOf(doc: DescriptionDoc, statusword: number): string | null {
  const machine = doc.state_machine;
  if (!machine) return axisStateKey(statusword);
  return machine.states.find(({ mask, bits }) => (statusword & mask) === bits)?.text_key ?? null;
}

/** Where an axis tells what every room shows of it, by the profile of its state machine. */
export interface AxisObjects {
  statusword: string;
  controlword: string;
  position: string;
  /** Null: the device tells none. */
  velocity: string | null;
  errorCode: string;
  target: string;
  speed: string;
}

const CIA_402: AxisObjects = {
  statusword: "6041",
  controlword: "6040",
  position: "6064",
  velocity: "606C",
  errorCode: "603F",
  target: "607A",
  speed: "60FF",
};

const OBJECTS: Readonly<Record<string, AxisObjects>> = {
  dsp408: {
    statusword: "0/38",
    controlword: "0/37",
    position: "12/100",
    velocity: null,
    errorCode: "0/36",
    target: "12/21",
    speed: "12/61",
  },
};

export const objectsOf = (doc: DescriptionDoc | undefined): AxisObjects =>
  OBJECTS[doc?.state_machine?.profile ?? ""] ?? CIA_402;
