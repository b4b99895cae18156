/**
 * From what is on the machine to what the drive holds: increments of an encoder and stages of gears become exact
 * fractions (manual 5.5, 5.6). The drive keeps the fractions alone, so that the stages can never be read back.
 * Nothing is rounded: what does not fit the objects exactly is refused.
 */
import { divide, type Fraction, fraction, times, toNumber } from "./decimal";

/** Two wheels: the driving one turns first. Teeth, or a ratio such as 183 to 1. */
export interface Stage {
  driving: string;
  driven: string;
}

/** An encoder with the gears between it and the blade, as a person types it. */
export interface Train {
  increments: string;
  /** Turns of the encoder that its increments are counted over; nearly always 1. */
  turns: string;
  stages: readonly Stage[];
  /** Position units per turn of the blade: 36000 makes them hundredths of a degree. */
  feed: string;
  feedTurns: string;
}

/** A fraction as two objects hold it: not reduced unless it had to be. */
export interface Held {
  above: bigint;
  below: bigint;
  reduced: boolean;
}

export enum Fault {
  /** No number, or not above 0. */
  NoNumber = "no_number",
  /** A count of increments, units or turns that is not whole. */
  NotWhole = "not_whole",
  /** Even reduced it is greater than the objects can hold. */
  TooLarge = "too_large",
}

export type Computed<T> = { ok: true; value: T } | { ok: false; fault: Fault };

/** The greatest that the two objects of a fraction hold. */
export interface Room {
  above: bigint;
  below: bigint;
}

export interface Scaling {
  resolution: Held;
  gear: Held;
  feed: Held;
}

export interface Rooms {
  resolution: Room;
  gear: Room;
  feed: Room;
}

const ONE: Fraction = { num: 1n, den: 1n };
const fault = (why: Fault): { ok: false; fault: Fault } => ({ ok: false, fault: why });

/** What the objects would hold of a train, and which part of it they cannot. */
export function scalingOf(train: Train, rooms: Rooms): { [Part in keyof Scaling]: Computed<Held> } {
  return {
    resolution: wholePair(train.increments, train.turns, rooms.resolution),
    gear: gearOf(train.stages, rooms.gear),
    feed: wholePair(train.feed, train.feedTurns, rooms.feed),
  };
}

/** All three, or null where one is wrong. */
export function wholeScaling(parts: ReturnType<typeof scalingOf>): Scaling | null {
  const { resolution, gear, feed } = parts;
  if (!resolution.ok || !gear.ok || !feed.ok) return null;
  return { resolution: resolution.value, gear: gear.value, feed: feed.value };
}

/** Driven by driving of all stages: 183 : 1 and 111 : 12 make 20313 / 12. No stage at all is 1 / 1. */
export function gearOf(stages: readonly Stage[], room: Room): Computed<Held> {
  let product = ONE;
  for (const stage of stages) {
    const driving = positive(stage.driving);
    const driven = positive(stage.driven);
    if (driving === null || driven === null) return fault(Fault.NoNumber);
    // Not `divide`: its factors stay as they were typed, so that 111 by 12 is not made 37 by 4.
    product = { num: product.num * driven.num * driving.den, den: product.den * driven.den * driving.num };
  }
  return hold(product, room);
}

/** The fraction as it stands where it fits, else reduced; refused where even that does not fit. */
export function hold(exact: Fraction, room: Room): Computed<Held> {
  const fits = (one: Fraction) => one.num <= room.above && one.den <= room.below;
  if (fits(exact)) return { ok: true, value: { above: exact.num, below: exact.den, reduced: false } };
  const least = reduce(exact);
  if (!fits(least)) return fault(Fault.TooLarge);
  return { ok: true, value: { above: least.num, below: least.den, reduced: true } };
}

function wholePair(above: string, below: string, room: Room): Computed<Held> {
  const numbers = [positive(above), positive(below)];
  const [first, second] = numbers;
  if (!first || !second) return fault(Fault.NoNumber);
  const whole = [first, second].map((one) => (one.num % one.den === 0n ? one.num / one.den : null));
  const [num, den] = whole;
  if (num == null || den == null) return fault(Fault.NotWhole);
  if (num > room.above || den > room.below) return fault(Fault.TooLarge);
  return { ok: true, value: { above: num, below: den, reduced: false } };
}

function positive(text: string): Fraction | null {
  const found = fraction(text);
  return found !== null && found.num > 0n ? found : null;
}

export function reduce(exact: Fraction): Fraction {
  let [a, b] = [exact.num, exact.den];
  while (b !== 0n) [a, b] = [b, a % b];
  return a === 0n ? exact : { num: exact.num / a, den: exact.den / a };
}

export const fractionOfHeld = ({ above, below }: Held): Fraction => ({ num: above, den: below });

/** What a person checks a scaling by. */
export interface Facts {
  /** Increments of a whole turn of the blade, and of one position unit. */
  perTurn: Fraction;
  perUnit: Fraction;
  /** Position units of one turn of the encoder. */
  unitsPerEncoderTurn: Fraction;
  /** Degrees of one position unit. */
  degreesPerUnit: Fraction;
}

export function factsOf({ resolution, gear, feed }: Scaling): Facts {
  const perTurn = times(fractionOfHeld(resolution), fractionOfHeld(gear));
  const units = fractionOfHeld(feed);
  return {
    perTurn: reduce(perTurn),
    perUnit: reduce(divide(perTurn, units)),
    unitsPerEncoderTurn: reduce(divide(units, fractionOfHeld(gear))),
    degreesPerUnit: reduce(divide({ num: 360n, den: 1n }, units)),
  };
}

/**
 * The greatest profile velocity (607Fh) that the motor can do, in whole units a second: speed / 60 x feed / gear ratio.
 * The feed is that of the encoder which 606Ah selects, the gear always the motor's.
 */
export function highestVelocity(speedRpm: number, gear: Held, feed: Held): bigint {
  const perSecond = times(
    { num: BigInt(speedRpm), den: 60n },
    divide(fractionOfHeld(feed), fractionOfHeld(gear)),
  );
  return perSecond.num / perSecond.den;
}

/** The motor speed that a profile velocity asks for, in whole revolutions a minute, rounded up. */
export function speedFor(velocity: number, gear: Held, feed: Held): bigint {
  const rpm = times(
    { num: BigInt(velocity) * 60n, den: 1n },
    divide(fractionOfHeld(gear), fractionOfHeld(feed)),
  );
  return (rpm.num + rpm.den - 1n) / rpm.den;
}

/** A slow move as three witnesses saw it, in degrees; null where one saw nothing. */
export interface Witnessed {
  motorDeg: number | null;
  bladeDeg: number | null;
  scaleDeg: number | null;
}

export enum Agreement {
  Agrees = "agrees",
  Off = "off",
  /** The other way round: the polarity is wrong. */
  Reversed = "reversed",
  Unknown = "unknown",
}

export interface Judged {
  agreement: Agreement;
  /** By which the ratio in the drive has to be multiplied. */
  factor: number | null;
}

/** Below this a move says nothing of a ratio: play and the eye weigh too much. */
export const LEAST_MOVE_DEG = 2;
/** What play of the gear and reading a scale may make up, in degrees. */
export const TOLERANCE_DEG = 0.3;

/**
 * What an encoder said against what really moved. Where the blade moved less than the drive believes, its ratio is
 * greater than the drive's, by that factor.
 */
export function judge(saidDeg: number | null, movedDeg: number | null): Judged {
  if (
    saidDeg === null ||
    movedDeg === null ||
    Math.abs(movedDeg) < LEAST_MOVE_DEG ||
    Math.abs(saidDeg) < 0.01
  )
    return { agreement: Agreement.Unknown, factor: null };
  const factor = Math.abs(saidDeg / movedDeg);
  if (Math.sign(saidDeg) !== Math.sign(movedDeg)) return { agreement: Agreement.Reversed, factor };
  const off = Math.abs(saidDeg - movedDeg) > TOLERANCE_DEG;
  return { agreement: off ? Agreement.Off : Agreement.Agrees, factor };
}

/** The ratio that the gear would have to have, as a number to look at. */
export const ratioBy = (gear: Held, factor: number): number => toNumber(fractionOfHeld(gear)) * factor;

const SEPARATORS = { train: "~", stage: "x", pair: "/" } as const;

/** A train as a link carries it: `1024/1~1/183x12/111~36000/1`. */
export function trainText({ increments, turns, stages, feed, feedTurns }: Train): string {
  const pair = (a: string, b: string) => `${a}${SEPARATORS.pair}${b}`;
  return [
    pair(increments, turns),
    stages.map((one) => pair(one.driving, one.driven)).join(SEPARATORS.stage),
    pair(feed, feedTurns),
  ].join(SEPARATORS.train);
}

const PAIR = /^([\d.,]*)\/([\d.,]*)$/;
export const MOST_STAGES = 6;

/** What a link says; null where it is damaged. */
export function readTrain(text: string): Train | null {
  const [first, middle, last, ...more] = text.split(SEPARATORS.train);
  const resolution = PAIR.exec(first ?? "");
  const feed = PAIR.exec(last ?? "");
  if (!resolution || !feed || middle === undefined || more.length > 0) return null;
  const stages: Stage[] = [];
  for (const one of middle === "" ? [] : middle.split(SEPARATORS.stage)) {
    const pair = PAIR.exec(one);
    if (!pair) return null;
    stages.push({ driving: pair[1] ?? "", driven: pair[2] ?? "" });
  }
  if (stages.length > MOST_STAGES) return null;
  return {
    increments: resolution[1] ?? "",
    turns: resolution[2] ?? "",
    stages,
    feed: feed[1] ?? "",
    feedTurns: feed[2] ?? "",
  };
}
