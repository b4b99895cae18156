import { describe, expect, it } from "vitest";
import type { RuleDoc, RuleFinding, StationFindings } from "../api/rules";
import { translator } from "../texts/texts";
import {
  about,
  byPlace,
  lineOfFinding,
  pendingOf,
  reasonOfFinding,
  stationOf,
  touching,
} from "./ruleFindings";

const PMM = "w/blade-1/pmm";
const PMC = "w/blade-1/pmc";

const finding = (change: Partial<RuleFinding>): RuleFinding => ({
  rule: "oat.dc_link_ladder",
  severity: "error",
  verdict: "broken",
  places: [],
  details: {},
  ...change,
});
const LADDER = finding({
  places: [
    { device: PMC, address: "6510:04" },
    { device: PMM, address: "30FA:03" },
  ],
  details: { lower: "6510:04", lower_v: 410 },
});
const UNJUDGED = finding({
  verdict: "not-checked",
  places: [{ device: PMM, address: "30FC:01" }],
  details: { missing: "30FC:01" },
});
const RULES: RuleDoc[] = [
  {
    id: "oat.dc_link_ladder",
    section: "4.2.2",
    severity: "error",
    stepwise: true,
    objects: { "oat-pmc": ["6510:04"], "oat-pmm": ["30FA:03", "30FC:01"] },
  },
];

describe("findings by place", () => {
  it("mark every object of a broken rule, and none of one that was not judged", () => {
    const stations: StationFindings[] = [{ station: "w/blade-1", devices: [], findings: [LADDER, UNJUDGED] }];
    expect([...byPlace(stations).keys()]).toEqual([`${PMC} 6510:04`, `${PMM} 30FA:03`]);
  });

  it("are about an object where they mark it, or where its rule could not be judged", () => {
    const findings = [LADDER, UNJUDGED];
    expect(about(findings, RULES, PMM, "oat-pmm", "30FA:03")).toEqual([LADDER, UNJUDGED]);
    expect(about(findings, RULES, PMM, "oat-pmm", "30FC:01")).toEqual([UNJUDGED]);
    expect(about(findings, RULES, PMM, "oat-pmm", "3110:01")).toEqual([]);
  });

  it("touch what is pending on any of the devices", () => {
    expect(touching([LADDER], { [PMM]: { "30FA:03": 400 } })).toEqual([LADDER]);
    expect(touching([LADDER, UNJUDGED], { [PMC]: { "6510:05": 800 } })).toEqual([]);
  });
});

describe("what is asked", () => {
  it("is all that is pending, with what is typed in place of its own", () => {
    const changes = [
      { device: PMM, address: "30FA:01", raw: 570 },
      { device: PMC, address: "6510:04", raw: 120 },
    ];
    expect(pendingOf(changes, { device: PMC, address: "6510:04", raw: 410 })).toEqual({
      [PMM]: { "30FA:01": 570 },
      [PMC]: { "6510:04": 410 },
    });
  });

  it("is of the device's station", () => {
    expect(stationOf(PMM)).toBe("w/blade-1");
  });
});

describe("a finding in words", () => {
  const t = translator(
    {
      "rule.oat.dc_link_ladder.broken": "{lower} = {lower_v} V",
      "rule.not_checked": "Not checked: {missing}",
      "rule.oat.dc_link_ladder.title": "Order",
      "rule.oat.dc_link_ladder.why": "They act on one voltage.",
      "rule.at_default": "{at_default} holds its default",
      "page.rules.rule": "Rule: {title}.",
    },
    "en",
  );

  it("names the values, or what is missing", () => {
    expect(lineOfFinding(LADDER, t)).toBe("6510:04 = 410 V");
    expect(lineOfFinding(UNJUDGED, t)).toBe("Not checked: 30FC:01");
    const german = translator({ "rule.oat.dc_link_ladder.broken": "{lower_v} V" }, "de");
    expect(lineOfFinding({ ...LADDER, details: { lower_v: 0.5 } }, german)).toBe("0,5 V");
  });

  it("has the rule behind it, and says where a value was never set", () => {
    expect(reasonOfFinding(LADDER, t)).toBe("Rule: Order. They act on one voltage.");
    const standing = { ...LADDER, details: { at_default: "6510:04" } };
    expect(reasonOfFinding(standing, t)).toMatch(/voltage\. 6510:04 holds its default\.$/);
  });
});
