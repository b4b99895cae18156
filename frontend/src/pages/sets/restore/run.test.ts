import { describe, expect, it } from "vitest";
import type { RestoreDoc, RestoreStep, RestoreValue } from "../../../api/restore";
import { keptOf, minutesOf, phasesOf, Stage, stageOf } from "./run";

const step = (n: number, kind: RestoreStep["kind"], more: Partial<RestoreStep> = {}): RestoreStep => ({
  n,
  direction: "forward",
  kind,
  device: "a",
  category: null,
  address: null,
  shown: null,
  state: "done",
  begun_ns: 0,
  ended_ns: 0,
  error: null,
  ...more,
});

const value = (state: RestoreValue["state"], written: RestoreValue["written"] = null): RestoreValue => ({
  device: "a",
  address: "6065",
  name: "",
  save_category: null,
  unit: "",
  before_raw: 1,
  wanted_raw: 2,
  before_shown: "1",
  wanted_shown: "2",
  state,
  written,
});

const run = (
  state: RestoreDoc["state"],
  steps: RestoreStep[] = [],
  restart = true,
  end: RestoreDoc["end"] = null,
) => ({ state, steps, restart, end }) as RestoreDoc;

describe("how far a value is", () => {
  const stage = (one: RestoreValue, steps: RestoreStep[]) => stageOf(one, keptOf(run("proving", steps)));

  it("goes from waiting over sent and read back to saved and proven", () => {
    expect(stage(value("waiting"), [])).toBe(Stage.Waiting);
    expect(stage(value("intended", "wanted"), [])).toBe(Stage.Sent);
    expect(stage(value("done", "wanted"), [step(0, "write")])).toBe(Stage.ReadBack);
    const saved = [step(0, "write"), step(1, "save")];
    expect(stage(value("done", "wanted"), saved)).toBe(Stage.Saved);
    expect(stage(value("done", "wanted"), [...saved, step(2, "prove")])).toBe(Stage.Saved);
    const restarted = [...saved, step(2, "restart"), step(3, "prove")];
    expect(stage(value("done", "wanted"), restarted)).toBe(Stage.Proven);
  });

  it("takes a save of a category for a save of its values only", () => {
    const tuning = [step(0, "write"), step(1, "save", { category: "tuning" })];
    const of = (save_category: string) => ({ ...value("done", "wanted"), save_category });
    expect(stage(of("tuning"), tuning)).toBe(Stage.Saved);
    expect(stage(of("drive"), tuning)).toBe(Stage.ReadBack);
  });

  it("does not take a save that is on its way, or one of an earlier way, for a save", () => {
    expect(stage(value("done", "wanted"), [step(0, "save", { state: "intended" })])).toBe(Stage.ReadBack);
    const turned = [step(0, "save"), step(1, "write", { direction: "resume" })];
    expect(stage(value("done", "wanted"), turned)).toBe(Stage.ReadBack);
  });

  it("stays as it was where all was put back before its turn", () => {
    const ended = keptOf(run("rolled-back", [], true, "old"));
    expect(stageOf(value("waiting"), ended)).toBe(Stage.Untouched);
  });

  it("tells what failed, what is unknown and what was put back", () => {
    expect(stage(value("failed", "wanted"), [])).toBe(Stage.Failed);
    expect(stage(value("unknown", "wanted"), [])).toBe(Stage.Unknown);
    expect(stage(value("done", "before"), [step(0, "save", { direction: "back" })])).toBe(Stage.Back);
  });
});

describe("the phases of a run", () => {
  it("are done, now or still to come, without a restart that nobody wanted", () => {
    const phases = phasesOf(run("saving", [], false));
    expect(phases?.map((one) => `${one.phase} ${one.standing}`)).toEqual([
      "writing done",
      "confirmation done",
      "saving now",
      "proving waiting",
    ]);
  });

  it("are none on the way back", () => {
    expect(phasesOf(run("rolling-back"))).toBeNull();
  });
});

describe("the time that is left", () => {
  it("never shows zero while there is some", () => {
    expect(minutesOf(247.3)).toBe("4:08");
    expect(minutesOf(0.2)).toBe("0:01");
    expect(minutesOf(-1)).toBe("0:00");
  });
});
