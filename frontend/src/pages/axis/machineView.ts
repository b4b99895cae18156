/** A state machine as it is drawn: boxes, arrows between them, and what can be commanded. */
import type { MachineState, StateMachine } from "../../model/stateMachine";
import { TRANSITIONS, WORDS } from "./transitions";

export interface Box {
  name: string;
  textKey: string;
  fault: boolean;
  x: number;
  y: number;
}

export interface Arrow {
  /** As the manual counts it. */
  name: string;
  /** Null: from every state. */
  from: string | null;
  /** Text key of where it leads. */
  toKey: string;
  /** Text key of the command; null: the drive goes by itself. */
  commandKey: string | null;
  word: string;
  path: string;
  at: readonly [number, number];
}

export interface MachineView {
  width: number;
  height: number;
  boxes: readonly Box[];
  arrows: readonly Arrow[];
}

export const WIDTH = 156;
export const HEIGHT = 36;
const LEFT = 2;
const RIGHT = 250;
const TOP = 4;
const ROW = 72;
/** An arrow ends so long before its box: there is its head. */
const GAP = 3;
const [DOWN_X, UP_X] = [42, 110];
const STUB = 34;
const DETOUR = 16;

const box = (name: string, x: number, y: number): Box => ({
  name,
  textKey: `axis_state.${name}`,
  fault: name.startsWith("fault"),
  x,
  y,
});

/** The states of CiA 402 in the arrangement of the standard: power off above, operation below, faults to the right. */
export const CIA_402_VIEW: MachineView = {
  width: 410,
  height: 350,
  boxes: [
    box("not_ready_to_switch_on", LEFT, 4),
    box("switch_on_disabled", LEFT, 76),
    box("ready_to_switch_on", LEFT, 148),
    box("switched_on", LEFT, 220),
    box("operation_enabled", LEFT, 292),
    box("quick_stop_active", RIGHT, 220),
    box("fault", RIGHT, 76),
    box("fault_reaction_active", RIGHT, 4),
  ],
  arrows: TRANSITIONS.map(({ number, from, to, command, path, at }) => ({
    name: String(number),
    from,
    toKey: `axis_state.${to}`,
    commandKey: command === null ? null : `command.${command}`,
    word: command === null ? "" : WORDS[command],
    path,
    at,
  })),
};

/** What can be commanded from a state. An EFC goes from every state but those of a fault that keeps the motor from running. */
export const commandsFrom = ({ arrows }: MachineView, state: string | undefined): readonly Arrow[] =>
  arrows.filter((one) => one.commandKey !== null && one.from !== null && one.from === state);

const xOf = ({ place }: MachineState) => (place[0] === 0 ? LEFT : RIGHT);
const yOf = ({ place }: MachineState) => TOP + place[1] * ROW;

type Drawn = Pick<Arrow, "path" | "at">;

/** From anywhere: a stub on the side where there is room. */
function stub(to: MachineState): Drawn {
  const y = yOf(to) + HEIGHT / 2;
  const left = xOf(to) === LEFT;
  const end = left ? LEFT + WIDTH + GAP : RIGHT - GAP;
  const start = left ? end + STUB : end - STUB;
  return { path: `M${start} ${y} H${end}`, at: [left ? start - 20 : start - 8, y - 7] };
}

function between(from: MachineState, to: MachineState, states: readonly MachineState[]): Drawn {
  const [x, fromY, toY] = [xOf(from), yOf(from), yOf(to)];
  if (x !== xOf(to)) {
    const rightwards = x === LEFT;
    const start = rightwards ? LEFT + WIDTH : RIGHT;
    const end = rightwards ? RIGHT - GAP : LEFT + WIDTH + GAP;
    const [y1, y2] = [fromY + HEIGHT / 2, toY + HEIGHT / 2];
    return { path: `M${start} ${y1} L${end} ${y2}`, at: [(start + end) / 2 - 18, (y1 + y2) / 2 - 7] };
  }
  const down = toY > fromY;
  const passes = states.some(
    ({ place }) =>
      place[0] === from.place[0] && Math.sign(place[1] - from.place[1]) === Math.sign(to.place[1] - place[1]),
  );
  if (passes) {
    const [edge, y1, y2] = [x + WIDTH, fromY + HEIGHT / 2, toY + HEIGHT / 2];
    return { path: `M${edge} ${y1} h${DETOUR} V${y2} H${edge + GAP}`, at: [edge - 34, fromY + HEIGHT + 20] };
  }
  const lane = x + (down ? DOWN_X : UP_X);
  const path = down ? `M${lane} ${fromY + HEIGHT} V${toY - GAP}` : `M${lane} ${fromY} V${toY + HEIGHT + GAP}`;
  const middle = (Math.min(fromY, toY) + HEIGHT + Math.max(fromY, toY)) / 2;
  return { path, at: [down ? lane - 36 : lane + 6, middle + 4] };
}

const hex = (word: number) => `${word.toString(16).toUpperCase().padStart(4, "0")}h`;

/** Boxes where the description places them; straight arrows, and a detour where a box stands in the way. */
export function viewOf(machine: StateMachine): MachineView {
  const { states } = machine;
  const byName = new Map(states.map((state) => [state.name, state]));
  const arrows = machine.transitions.flatMap(({ name, source, target, word, command_key: commandKey }) => {
    const [from, to] = [byName.get(source), byName.get(target)];
    if (!to) return [];
    return {
      name,
      from: from?.name ?? null,
      toKey: to.text_key,
      commandKey,
      word: word === null ? "" : hex(word),
      ...(from ? between(from, to, states) : stub(to)),
    };
  });
  return {
    width: RIGHT + WIDTH + DETOUR + 4,
    height: Math.max(...states.map(yOf)) + HEIGHT + TOP,
    boxes: states.map((state) => ({
      name: state.name,
      textKey: state.text_key,
      fault: state.fault,
      x: xOf(state),
      y: yOf(state),
    })),
    arrows,
  };
}
