import { describe, expect, it } from "vitest";
import type { PlanDoc, PlanFinding, PlanRow } from "../../../api/restore";
import { translator } from "../../../texts/texts";
import {
  groupsOf,
  inView,
  isPicked,
  linesOf,
  pick,
  type PlanLine,
  selectedIn,
  selectText,
  View,
} from "./plan";

const t = translator(
  {
    "restore.why.misfit": "no: {error}",
    "error.limit": "too large",
    "page.restoring.row.write": "is written",
  },
  "en",
);

const row = (address: string, more: Partial<PlanRow>): PlanRow => ({
  device: address.startsWith("3") ? "w/b/pmm" : "w/b/pmc",
  address,
  name: `name ${address}`,
  group: address.startsWith("3") ? "battery" : "drive",
  restore_class: "copy",
  save_category: null,
  unit: "",
  treatment: "write",
  why: null,
  why_key: null,
  details: {},
  now_raw: 1,
  wanted_raw: 2,
  now_shown: "1",
  wanted_shown: "2",
  ...more,
});

const plan = (rows: PlanRow[], more: Partial<PlanDoc> = {}): PlanDoc => ({
  station: "w/b",
  hash: "",
  refusals: [],
  sources: [],
  rows,
  steps: [],
  needs: {},
  by_hand: [],
  restarts: [],
  findings: [],
  blockers: [],
  mended: [],
  unordered: [],
  ...more,
});

const lines = (doc: PlanDoc): PlanLine[] => linesOf(doc, { t, contexts: new Map(), nameOf: (slug) => slug });

const skipped = (why: string, more: Partial<PlanRow> = {}) =>
  ({ treatment: "skip", why, why_key: `restore.why.${why}`, ...more }) as const;

const ROWS = [
  row("3020:01", {}),
  row("3020:02", skipped("not-selected")),
  row("6065", {}),
  row("6073", skipped("misfit", { details: { error_key: "error.limit" } })),
  row("6041", skipped("read-only")),
  row("6040", skipped("never")),
  row("6066", skipped("not-in-set", { wanted_raw: null })),
  row("6067", { treatment: "equal", wanted_raw: 1 }),
];

describe("what becomes of each object", () => {
  it("says why something is not restored, in words that may hold other words", () => {
    expect(lines(plan(ROWS))[3]?.outcome).toBe("no: too large");
  });

  it("shows among the differences what is written and what stays different, and nothing that never matters", () => {
    const shown = lines(plan(ROWS)).filter((line) => inView(line, View.Differences));
    expect(shown.map((line) => line.row.address)).toEqual(["3020:01", "3020:02", "6065", "6073"]);
  });

  it("marks what has no safe order and what breaks a rule", () => {
    const place = { device: "w/b/pmc", address: "6065" };
    const finding: PlanFinding = {
      rule: "r",
      severity: "error",
      verdict: "broken",
      is_new: true,
      places: [place],
      details: {},
    };
    const unjudged: PlanFinding = { ...finding, rule: "s", verdict: "not-checked" };
    const doc = plan(ROWS, { unordered: [place], findings: [finding, unjudged] });
    const line = lines(doc)[2];
    expect(line?.unordered).toBe(true);
    expect(line?.rules).toEqual(["r"]);
  });

  it("puts what can be picked into groups", () => {
    const groups = groupsOf(lines(plan(ROWS)));
    expect(groups.map((one) => [one.id, one.lines.length])).toEqual([
      ["battery", 2],
      ["drive", 1],
    ]);
  });
});

describe("what is picked", () => {
  const all = lines(plan(ROWS));
  const now = new Set(all.filter(isPicked).map((line) => line.id));

  it("is told by its addresses, and not at all where it is everything", () => {
    const fewer = pick(all, now, all.slice(0, 1), false);
    expect(selectText(fewer)).toBe("6065");
    expect(selectText(pick(all, now, all.slice(1, 2), true))).toBeUndefined();
  });

  it("can be nothing", () => {
    const none = pick(all, now, all, false);
    expect(selectText(none)).toBe("-");
    expect(selectedIn("-", ["w/b/pmc"])).toEqual([]);
    expect(selectedIn(undefined, ["w/b/pmc"])).toBeNull();
  });

  it("asks every device of the station for an address", () => {
    expect(selectedIn("6065", ["a", "b"])).toEqual([
      { device: "a", address: "6065" },
      { device: "b", address: "6065" },
    ]);
  });
});
