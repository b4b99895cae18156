import { expect, test } from "vitest";
import type { DescriptionDoc } from "../api/types";
import { objectsOf, type StateMachine, stateKeyOf } from "./stateMachine";

const state = (name: string, bits: number) => ({
  name,
  text_key: `dsp408_state.${name}`,
  bits,
  mask: 0xf,
  powered: false,
  runs: false,
  fault: false,
  place: [0, 0] as const,
});

const machine: StateMachine = {
  profile: "dsp408",
  controlword: "0/37",
  statusword: "0/38",
  stop_word: 0,
  states: [state("init", 8), state("hold", 0xb)],
  transitions: [],
};

const docOf = (own: StateMachine | null) => ({ state_machine: own }) as DescriptionDoc;

test("a state is told by the machine of the description, whatever the other bits are", () => {
  expect(stateKeyOf(docOf(machine), 0x300b)).toBe("dsp408_state.hold");
  expect(stateKeyOf(docOf(machine), 0x0008)).toBe("dsp408_state.init");
  expect(stateKeyOf(docOf(machine), 0x0002)).toBeNull();
});

test("a description without one has that of CiA 402", () => {
  expect(stateKeyOf(docOf(null), 0x0627)).toBe("axis_state.operation_enabled");
  expect(objectsOf(docOf(null)).statusword).toBe("6041");
  expect(objectsOf(docOf(machine)).position).toBe("12/100");
  expect(objectsOf(undefined).position).toBe("6064");
});
