import { describe, expect, it } from "vitest";
import type { Job, JobRow } from "../api/types";
import { type Change, keyOf, MOST_UNDO_SETS, StagedStore } from "./staged";

const PMM = "wtg-07/blade-1/pmm";
const change = (raw: number, from: number | null = 500, address = "3110:01") =>
  ({ device: PMM, address, raw, from, atMs: 1 }) satisfies Omit<Change, "refused">;

function opened() {
  const kept = new Map<string, string>();
  const keeper = {
    getItem: (key: string) => kept.get(key) ?? null,
    setItem: (key: string, text: string) => void kept.set(key, text),
  };
  const again = () => {
    const store = new StagedStore(keeper, () => 7);
    store.open("wtg-07");
    return store;
  };
  return { store: again(), again, kept };
}

const row = (state: JobRow["state"], parts: Partial<JobRow> = {}): JobRow => ({
  device: PMM,
  address: "3110:01",
  state,
  was_raw: 500,
  read_raw: 490,
  error: null,
  ...parts,
});
const job = (...rows: JobRow[]): Job => ({
  id: "j",
  kind: "write",
  device: "",
  state: "done",
  done: 1,
  total: 1,
  failed: [],
  error: null,
  rows,
});

describe("what is pending", () => {
  it("is kept over a reload, for its turbine alone", () => {
    const { store, again } = opened();
    store.stage([change(490)]);
    expect(again().get(PMM, "3110:01")?.raw).toBe(490);
    store.open("wtg-08");
    expect(store.state.changes.size).toBe(0);
  });

  it("is nothing where what was kept is damaged", () => {
    const { again, kept } = opened();
    kept.set("hubside.staged.wtg-07", "{");
    expect(again().state.changes.size).toBe(0);
  });

  it("goes when it is set back to what RAM holds", () => {
    const { store } = opened();
    store.stage([change(490)]);
    store.stage([change(500)]);
    expect(store.state.changes.size).toBe(0);
  });
});

describe("the end of a write", () => {
  it("takes out what was written and leaves an undo set", () => {
    const { store } = opened();
    store.stage([change(490)]);
    store.begin("j", [...store.state.changes.values()]);
    const set = store.finish(job(row("saved")));
    expect(store.state.changes.size).toBe(0);
    expect(set?.rows).toEqual([{ device: PMM, address: "3110:01", was: 500, written: 490 }]);
    if (set) store.undo(set);
    expect(store.get(PMM, "3110:01")).toMatchObject({ raw: 500, from: 490 });
  });

  it("keeps what was refused, with the reason, and what was not begun", () => {
    const { store } = opened();
    store.stage([change(490), change(1, 0, "3110:02")]);
    store.begin("j", [...store.state.changes.values()]);
    const error = { address: "3110:01", code: "limit", text_key: "error.limit", details: {} };
    const set = store.finish(job(row("refused", { error }), row("waiting", { address: "3110:02" })));
    expect(set).toBeNull();
    expect(store.get(PMM, "3110:01")?.refused?.code).toBe("limit");
    expect(store.get(PMM, "3110:02")?.refused).toBeNull();
  });

  it("leaves what was edited anew meanwhile", () => {
    const { store } = opened();
    store.stage([change(490)]);
    store.begin("j", [...store.state.changes.values()]);
    store.stage([change(480)]);
    store.finish(job(row("verified")));
    expect(store.get(PMM, "3110:01")?.raw).toBe(480);
  });

  it("is taken once, and of its own job alone", () => {
    const { store } = opened();
    store.stage([change(490)]);
    expect(store.finish(job(row("saved")))).toBeNull();
    expect(store.state.changes.size).toBe(1);
  });

  it("keeps the latest undo sets only", () => {
    const { store } = opened();
    for (let round = 0; round < MOST_UNDO_SETS + 3; round += 1) {
      store.stage([change(490)]);
      store.begin("j", [...store.state.changes.values()]);
      store.finish(job(row("saved")));
    }
    expect(store.state.undo).toHaveLength(MOST_UNDO_SETS);
  });
});

it("confirms a conflict by taking what RAM holds now as the start", () => {
  const { store } = opened();
  store.stage([change(490)]);
  store.confirm(keyOf(PMM, "3110:01"), 510);
  expect(store.get(PMM, "3110:01")).toMatchObject({ raw: 490, from: 510 });
});
