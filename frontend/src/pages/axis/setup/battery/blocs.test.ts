import { describe, expect, it } from "vitest";
import { blocsOf, ChargeStage, curve, Flow, flowOf, stageOf, weakest } from "./blocs";

const reading = (number: number, mv: number | null) => ({ number, mv, tenthsC: 250 });

describe("the string of blocs", () => {
  it("marks the least and the greatest, and how full each is", () => {
    const found = blocsOf([reading(1, 40100), reading(2, 38000), reading(3, 40500)], 36000, 41000);
    expect(found.map((one) => [one.least, one.greatest])).toEqual([
      [false, false],
      [true, false],
      [false, true],
    ]);
    expect(found.map((one) => one.fill).every((fill) => fill !== null && fill > 0 && fill < 1)).toBe(true);
    expect((found[1]?.fill ?? 1) < (found[0]?.fill ?? 0)).toBe(true);
  });

  it("marks nothing where all are alike, unknown or alone", () => {
    const marks = (mv: (number | null)[]) =>
      blocsOf(
        mv.map((one, at) => reading(at + 1, one)),
        36000,
        41000,
      ).some((one) => one.least || one.greatest);
    expect([marks([40100, 40110]), marks([null, null]), marks([40100]), marks([])]).toEqual([
      false,
      false,
      false,
      false,
    ]);
    expect(blocsOf([reading(1, null)], 36000, 41000)[0]?.fill).toBeNull();
  });
});

it("reads the current by its sign", () => {
  expect([flowOf(400), flowOf(-2), flowOf(0), flowOf(null)]).toEqual([
    Flow.Discharges,
    Flow.Charges,
    Flow.Rests,
    Flow.Unknown,
  ]);
});

it("reads the stages of the charger", () => {
  expect(stageOf(0b0111, 230, 241)).toBe(ChargeStage.Current);
  expect(stageOf(0b1011, 230, 241)).toBe(ChargeStage.Voltage);
  expect(stageOf(0b0001, 242, 241)).toBe(ChargeStage.Full);
  expect(stageOf(0b0001, 239, 241)).toBe(ChargeStage.Off);
  expect(stageOf(0b0001, null, 241)).toBe(ChargeStage.Off);
  expect(stageOf(null, 242, 241)).toBeNull();
});

it("draws a course, gaps left out", () => {
  const box = { width: 100, height: 50, low: 200, high: 250, untilMs: 1000 };
  expect(curve([250, null, 200], [0, 500, 1000], box)).toBe("0.0,0.0 100.0,50.0");
  expect(curve([], [], box)).toBe("");
});

it("names the weakest bloc of a course", () => {
  expect(weakest([{ blocs_mv: [40000, 39000] }, { blocs_mv: [39500, 31000, null, 0] }])).toEqual({
    number: 2,
    mv: 31000,
  });
  expect(weakest([{ blocs_mv: [null] }])).toBeNull();
});
