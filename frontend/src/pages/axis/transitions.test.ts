import { describe, expect, it } from "vitest";
import { CIA_402_VIEW, commandsFrom } from "./machineView";
import { Command, TRANSITIONS, WORDS } from "./transitions";

const numbers = (state: string) => commandsFrom(CIA_402_VIEW, state).map((one) => Number(one.name));

describe("the transitions of CiA 402", () => {
  it("are each there once", () => {
    const all = TRANSITIONS.map((one) => one.number).sort((a, b) => a - b);
    expect(all).toEqual([...Array(16).keys()].map((n) => n + 1));
  });

  it("tell what can be commanded from where", () => {
    expect(numbers("switch_on_disabled")).toEqual([2]);
    expect(numbers("ready_to_switch_on")).toEqual([7, 3]);
    expect(numbers("switched_on")).toEqual([6, 4, 10]);
    expect(numbers("operation_enabled")).toEqual([5, 8, 9, 11]);
    expect(numbers("quick_stop_active")).toEqual([12, 16]);
    expect(numbers("fault")).toEqual([15]);
    expect(numbers("fault_reaction_active")).toEqual([]);
    expect(commandsFrom(CIA_402_VIEW, undefined)).toEqual([]);
  });

  it("are commanded by the controlwords of table 52", () => {
    const bits = (command: Command) => parseInt(WORDS[command], 16) & 0x8f;
    // Commands of CiA 402 by bits 7, 3, 2, 1, 0.
    expect(bits(Command.Shutdown)).toBe(0b0110);
    expect(bits(Command.SwitchOn)).toBe(0b0111);
    expect(bits(Command.EnableOperation)).toBe(0b1111);
    expect(bits(Command.DisableVoltage) & 0b10).toBe(0);
    expect(bits(Command.QuickStop) & 0b110).toBe(0b010);
    expect(bits(Command.FaultReset) & 0x80).toBe(0x80);
    expect(parseInt(WORDS[Command.Feather], 16) & 0x800).toBe(0x800);
  });
});
