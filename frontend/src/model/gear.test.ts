import { describe, expect, it } from "vitest";
import {
  Agreement,
  Fault,
  factsOf,
  gearOf,
  type Held,
  highestVelocity,
  hold,
  judge,
  ratioBy,
  readTrain,
  reduce,
  type Rooms,
  scalingOf,
  speedFor,
  type Stage,
  type Train,
  trainText,
  wholeScaling,
} from "./gear";

const MOST = 0xffffffffn;
const ROOMS: Rooms = {
  resolution: { above: MOST, below: MOST },
  gear: { above: 32767n, below: 32767n },
  feed: { above: MOST, below: 32767n },
};
const PITCH: Train = {
  increments: "1024",
  turns: "1",
  stages: [
    { driving: "1", driven: "183" },
    { driving: "12", driven: "111" },
  ],
  feed: "36000",
  feedTurns: "1",
};

const scaled = (train: Train) => {
  const whole = wholeScaling(scalingOf(train, ROOMS));
  if (whole === null) throw new Error("it does not fit");
  return whole;
};
const held = (above: number, below: number): Held => ({
  above: BigInt(above),
  below: BigInt(below),
  reduced: false,
});

/** The same numbers with every run. */
function* numbers(count: number, most: number): Generator<number> {
  let seed = 4711;
  for (let at = 0; at < count; at++) {
    seed = (seed * 48271) % 2147483647;
    yield 1 + (seed % most);
  }
}

describe("the manual's pitch system", () => {
  it("makes exactly 1024, 20313/12 and 36000", () => {
    expect(scaled(PITCH)).toEqual({
      resolution: { above: 1024n, below: 1n, reduced: false },
      gear: { above: 20313n, below: 12n, reduced: false },
      feed: { above: 36000n, below: 1n, reduced: false },
    });
  });

  it("has the increments and units that its factors give", () => {
    const facts = factsOf(scaled(PITCH));
    expect(facts.perTurn).toEqual({ num: 1733376n, den: 1n });
    // Position = internal x 375 / 18056.
    expect(facts.perUnit).toEqual({ num: 18056n, den: 375n });
    expect(facts.unitsPerEncoderTurn).toEqual(reduce({ num: 36000n * 12n, den: 20313n }));
    expect(facts.degreesPerUnit).toEqual({ num: 1n, den: 100n });
  });

  it("allows a profile velocity of 1063 units a second with 3000 rpm", () => {
    const { gear, feed } = scaled(PITCH);
    expect(highestVelocity(3000, gear, feed)).toBe(1063n);
    expect(speedFor(1063, gear, feed)).toBe(2999n);
    expect(speedFor(20000, gear, feed)).toBe(56425n);
  });

  it("has 9472 increments for its blade encoder, and no whole number with the bevel of 15 teeth", () => {
    const blade = (teeth: string): Train => ({ ...PITCH, stages: [{ driving: teeth, driven: "111" }] });
    expect(factsOf(scaled(blade("12"))).perTurn).toEqual({ num: 9472n, den: 1n });
    expect(factsOf(scaled(blade("15"))).perTurn).toEqual({ num: 37888n, den: 5n });
  });
});

describe("fractions", () => {
  it("are the product of all stages, whatever their order, and exact", () => {
    const teeth = [...numbers(60, 97)];
    for (let at = 0; at + 6 <= teeth.length; at += 6) {
      const stages: Stage[] = [0, 2, 4].map((place) => ({
        driving: String(teeth[at + place]),
        driven: String(teeth[at + place + 1]),
      }));
      const wide = { above: 10n ** 30n, below: 10n ** 30n };
      const [one, other] = [gearOf(stages, wide), gearOf([...stages].reverse(), wide)];
      expect(one).toEqual(other);
      const [a, b, c, d, e, f] = teeth.slice(at, at + 6).map(BigInt) as [
        bigint,
        bigint,
        bigint,
        bigint,
        bigint,
        bigint,
      ];
      expect(one).toEqual({ ok: true, value: { above: b * d * f, below: a * c * e, reduced: false } });
    }
  });

  it("are reduced only where they do not fit, never rounded, and refused where even that does not help", () => {
    const room = { above: 1000n, below: 1000n };
    const values = [...numbers(200, 5000)];
    let [reducedOnes, refused] = [0, 0];
    for (let at = 0; at + 1 < values.length; at += 2) {
      const exact = { num: BigInt(values[at] ?? 1) * 6n, den: BigInt(values[at + 1] ?? 1) * 6n };
      const found = hold(exact, room);
      if (!found.ok) {
        const least = reduce(exact);
        expect(least.num > 1000n || least.den > 1000n).toBe(true);
        refused++;
        continue;
      }
      const { above, below, reduced } = found.value;
      expect(above * exact.den).toBe(below * exact.num);
      expect(above <= 1000n && below <= 1000n).toBe(true);
      expect(reduced).toBe(exact.num > 1000n || exact.den > 1000n);
      if (reduced) reducedOnes++;
    }
    expect([reducedOnes > 0, refused > 0]).toEqual([true, true]);
  });

  it("take a ratio with decimals, in the manner of either language", () => {
    const ratio = (driven: string) => gearOf([{ driving: "1", driven }], ROOMS.gear);
    expect(ratio("15.25")).toEqual({ ok: true, value: { above: 1525n, below: 100n, reduced: false } });
    expect(ratio("15,25")).toEqual(ratio("15.25"));
    expect(gearOf([], ROOMS.gear)).toEqual({ ok: true, value: { above: 1n, below: 1n, reduced: false } });
  });

  it.each([
    ["", "1", Fault.NoNumber],
    ["12", "abc", Fault.NoNumber],
    ["0", "12", Fault.NoNumber],
    ["-3", "12", Fault.NoNumber],
    ["1", "40009", Fault.TooLarge],
  ])("refuse %s : %s", (driving, driven, why) => {
    expect(gearOf([{ driving, driven }], ROOMS.gear)).toEqual({ ok: false, fault: why });
  });

  it("want whole increments within their data type", () => {
    const parts = (increments: string) => scalingOf({ ...PITCH, increments }, ROOMS).resolution;
    expect(parts("1024.5")).toEqual({ ok: false, fault: Fault.NotWhole });
    expect(parts("4294967296")).toEqual({ ok: false, fault: Fault.TooLarge });
    expect(parts("x")).toEqual({ ok: false, fault: Fault.NoNumber });
    expect(wholeScaling(scalingOf({ ...PITCH, feed: "0" }, ROOMS))).toBeNull();
  });
});

describe("the slow move", () => {
  it("agrees within what play and the eye make up", () => {
    expect(judge(10, 9.9)).toEqual({ agreement: Agreement.Agrees, factor: 10 / 9.9 });
    expect(judge(-10, -10.2).agreement).toBe(Agreement.Agrees);
  });

  it("names the ratio that would be right", () => {
    const found = judge(-10, -9.1);
    expect(found.agreement).toBe(Agreement.Off);
    expect(ratioBy(held(20313, 12), found.factor ?? 0)).toBeCloseTo(1860.16, 2);
  });

  it("finds any factor between the truth and the drive", () => {
    for (const percent of numbers(50, 300)) {
      const factor = (percent + 20) / 100;
      // The drive believes in 10 degrees; with a gear greater by `factor` the blade moves less by it.
      const found = judge(10, 10 / factor);
      if (found.agreement === Agreement.Unknown) expect(10 / factor).toBeLessThan(2);
      else expect(found.factor).toBeCloseTo(factor, 9);
    }
  });

  it("tells a wrong polarity, and says nothing of what did not move", () => {
    expect(judge(10, -10).agreement).toBe(Agreement.Reversed);
    expect(judge(10, 1).agreement).toBe(Agreement.Unknown);
    expect(judge(null, 10).agreement).toBe(Agreement.Unknown);
    expect(judge(10, null).agreement).toBe(Agreement.Unknown);
  });
});

describe("a link", () => {
  it("carries a train", () => {
    expect(trainText(PITCH)).toBe("1024/1~1/183x12/111~36000/1");
    expect(readTrain(trainText(PITCH))).toEqual(PITCH);
    expect(readTrain("512/~~36000/1")).toEqual({ ...PITCH, increments: "512", turns: "", stages: [] });
  });

  it.each(["", "1024", "a/b~~c/d", "1/1~1~1/1", "1/1~~1/1~", `1/1~${"1/1x".repeat(7)}1/1~1/1`])(
    "damaged: %s",
    (text) => {
      expect(readTrain(text)).toBeNull();
    },
  );
});
